import { useEffect, useRef, useState } from "preact/hooks";

interface Props {
  label: string;
  placeholder?: string;
  /** Called with what was typed, once one has stopped. */
  onSearch: (text: string) => void;
}

const PAUSE = 250; // after the last letter [ms]

/** Where one types what a list is to be searched for. */
export function SearchField({ label, placeholder = label, onSearch }: Props) {
  const [text, setText] = useState("");
  const first = useRef(true);
  useEffect(() => {
    if (first.current) {
      first.current = false;
      return;
    }
    const timer = setTimeout(() => onSearch(text.trim()), text ? PAUSE : 0);
    return () => clearTimeout(timer);
  }, [text]);
  return (
    <input
      type="search"
      class="search"
      aria-label={label}
      placeholder={placeholder}
      value={text}
      onInput={(event) => setText(event.currentTarget.value)}
    />
  );
}
