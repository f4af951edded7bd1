import type { ComponentChildren } from "preact";
import { Icon } from "./icons";

interface Props {
  kind?: "advice" | "warning" | "error";
  children: ComponentChildren;
  action?: ComponentChildren;
}

/** A remark with what to do about it. */
export function Note({ kind = "advice", children, action }: Props) {
  return (
    <div class={`note ${kind}`} role={kind === "error" ? "alert" : undefined}>
      <Icon name={kind === "advice" ? "target" : "alert"} />
      <div>{children}</div>
      {action}
    </div>
  );
}
