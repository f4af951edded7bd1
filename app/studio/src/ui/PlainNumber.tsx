import { useState } from "preact/hooks";
import { parseNumber } from "../store/units";
import { useDraft } from "./draft";

interface Props {
  label: string;
  unit: string;
  value: number | null;
  /** The least number that is taken; zero itself is refused where it is `"above zero"`. */
  least: "zero" | "above zero";
  /** What an empty field means; without it, a number must be given. */
  empty?: string;
  onValue: (value: number | null) => void;
}

/** A number beside the request, such as a price: a text that is none stays, with a sentence. */
export function PlainNumber({ label, unit, value, least, empty, onValue }: Props) {
  const [wrong, setWrong] = useState<string | null>(null);
  const { field, end } = useDraft(wrong ?? `${value ?? ""}`);
  const commit = (text: string) => {
    end();
    const number = parseNumber(text);
    const isEmpty = empty !== undefined && !text.trim();
    const isTaken = number !== null && (least === "zero" ? number >= 0 : number > 0);
    setWrong(isEmpty || isTaken ? null : text);
    if (isEmpty || isTaken) onValue(isEmpty ? null : number);
  };
  return (
    <>
      <input
        type="text"
        inputMode="decimal"
        aria-label={label}
        aria-invalid={wrong === null ? undefined : "true"}
        placeholder={empty}
        {...field}
        onChange={(event) => commit(event.currentTarget.value)}
      />
      <small>{unit}</small>
      {wrong !== null && (
        <small class="error" role="alert">
          Enter a number {least === "zero" ? "of at least 0" : "above 0"}
          {value === null ? "." : `; until then, ${value} is used.`}
        </small>
      )}
    </>
  );
}
