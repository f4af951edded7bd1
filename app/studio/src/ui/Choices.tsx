import { useEffect, useId, useRef, useState } from "preact/hooks";

export interface Choice {
  value: string;
  title: string;
  facts: string;
  note: string;
}

interface Props {
  /** Of the search field. */
  label: string;
  /** Of the list. */
  name: string;
  choices: Choice[];
  current: string;
  onChoose: (value: string) => void;
}

/** The choices in whose title or facts all words of a text occur, in any case. */
export function found(choices: Choice[], text: string): Choice[] {
  const words = text.toLowerCase().split(/\s+/);
  return choices.filter(({ title, facts }) => {
    const all = `${title} ${facts}`.toLowerCase();
    return words.every((word) => all.includes(word));
  });
}

/** Where a key leads from one of `count` entries; null if it leads nowhere. */
export function ledTo(key: string, index: number, count: number): number | null {
  const step = { ArrowDown: 1, ArrowUp: -1 }[key];
  return step && count ? (index + step + count) % count : null;
}

/**
 * A search field over the list that it filters: ARIA's combobox, whose list is always open. Arrows
 * move the highlight, Enter takes what is highlighted.
 */
export function Choices({ label, name, choices, current, onChoose }: Props) {
  const [text, setText] = useState("");
  const shown = found(choices, text);
  const first = text ? 0 : shown.findIndex(({ value }) => value === current);
  const [index, setIndex] = useState(Math.max(0, first));
  const id = useId();
  const field = useRef<HTMLInputElement>(null);
  const list = useRef<HTMLUListElement>(null);
  useEffect(() => field.current?.focus(), []);
  useEffect(() => {
    list.current?.children[index]?.scrollIntoView({ block: "nearest" });
  }, [index, text]);
  const onKey = (event: KeyboardEvent) => {
    const next = ledTo(event.key, index, shown.length);
    if (next !== null) setIndex(next);
    else if (event.key === "Enter" && shown[index]) onChoose(shown[index].value);
    else return;
    event.preventDefault();
  };
  const nameOf = (k: number) => `${id}-${k}`;
  return (
    <>
      <input
        ref={field}
        type="search"
        class="search"
        role="combobox"
        list={undefined}
        aria-expanded="true"
        aria-autocomplete="list"
        aria-controls={id}
        aria-activedescendant={shown[index] && nameOf(index)}
        aria-label={label}
        placeholder={label}
        value={text}
        onInput={(event) => {
          setText(event.currentTarget.value);
          setIndex(0);
        }}
        onKeyDown={onKey}
      />
      <p class="hint" role="status">
        {shown.length ? "" : "No entry has this name."}
      </p>
      <ul class="choices" role="listbox" id={id} aria-label={name} ref={list}>
        {shown.map(({ value, title, facts, note }, k) => (
          <li
            key={value}
            id={nameOf(k)}
            class="choice"
            role="option"
            aria-selected={k === index}
            aria-current={value === current}
            onClick={() => onChoose(value)}
          >
            <b>{title}</b>
            <small>{facts}</small>
            <small>{note}</small>
          </li>
        ))}
      </ul>
    </>
  );
}
