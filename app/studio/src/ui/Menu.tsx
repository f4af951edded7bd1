import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { Icon, type IconName } from "./icons";

interface Props {
  label: ComponentChildren;
  children: ComponentChildren;
  /** What a reader says, where the label is an icon. */
  name?: string;
  icon?: IconName;
  id?: string;
  quiet?: boolean;
}

/** A list that opens below its button; a click elsewhere and Escape close it. */
export function Menu({ label, children, name, icon, id, quiet }: Props) {
  const box = useRef<HTMLDetailsElement>(null);
  useEffect(() => {
    const shut = () => {
      const { current } = box;
      // the entry that was chosen vanishes with the list, and the focus would begin at the top
      if (current?.contains(document.activeElement)) current.querySelector("summary")?.focus();
      if (current) current.open = false;
    };
    const away = (event: Event) => {
      const { current } = box;
      const inside = current?.contains(event.target as Node);
      const chosen =
        inside && (event.target as HTMLElement).closest(".drop button:not([data-stays])");
      if (current?.open && (!inside || chosen)) setTimeout(shut);
    };
    const escape = (event: KeyboardEvent) => {
      if (event.key !== "Escape" || !box.current?.open) return;
      shut();
      event.stopPropagation();
    };
    const chosenFrom = (event: Event) => {
      const { current } = box;
      const { type } = event.target as HTMLInputElement | HTMLSelectElement;
      const isChoice = type === "file" || type === "select-one";
      if (isChoice && current?.contains(event.target as Node)) current.open = false;
    };
    document.addEventListener("click", away);
    document.addEventListener("change", chosenFrom);
    document.addEventListener("keydown", escape, true);
    return () => {
      document.removeEventListener("change", chosenFrom);
      document.removeEventListener("click", away);
      document.removeEventListener("keydown", escape, true);
    };
  }, []);
  // in a panel that scrolls, its last entries are below the edge
  const show = () =>
    box.current?.open && box.current.querySelector(".drop")!.scrollIntoView({ block: "nearest" });
  return (
    <details class="menu" ref={box} id={id} onToggle={show}>
      <summary class={`button${quiet ? " quiet" : ""}`} aria-label={name} title={name}>
        {icon && <Icon name={icon} />}
        {label}
      </summary>
      <div class="drop">{children}</div>
    </details>
  );
}
