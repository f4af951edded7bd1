import type { ComponentChildren } from "preact";
import { Icon, type IconName } from "./icons";

interface Props {
  onClick: () => unknown;
  children?: ComponentChildren;
  icon?: IconName;
  /** The next step, of which one is in view; `quiet`: without an edge; `link`: as words. */
  kind?: "primary" | "quiet" | "link";
  /** For buttons without words, or with fewer than they need. */
  label?: string;
  title?: string;
  id?: string;
  disabled?: boolean;
  pressed?: boolean;
  small?: boolean;
}

export function Button({
  onClick,
  children,
  icon,
  kind,
  label,
  title,
  id,
  disabled,
  pressed,
  small,
}: Props) {
  const names = ["button", kind, small && "small", !children && "bare"].filter(Boolean).join(" ");
  return (
    <button
      type="button"
      id={id}
      class={names}
      onClick={() => void onClick()}
      disabled={disabled}
      aria-label={label}
      title={title ?? (children ? undefined : label)}
      aria-pressed={pressed}
    >
      {icon && <Icon name={icon} />}
      {children}
    </button>
  );
}
