import type { ComponentChildren } from "preact";

interface Props {
  title: string;
  note?: ComponentChildren;
  action?: ComponentChildren;
  id?: string;
  children: ComponentChildren;
}

/** A part of a panel, below a line. */
export function Section({ title, note, action, id, children }: Props) {
  return (
    <section class="section" id={id} aria-label={title}>
      <header>
        <h2>{title}</h2>
        {note && <small>{note}</small>}
        <span class="space" />
        {action}
      </header>
      {children}
    </section>
  );
}
