import { useEffect, useState } from "preact/hooks";
import { changes, trouble, typed, unread, write } from "../store/state";
import type { Pointer } from "../store/pointer";
import { shown, typedValue, UNITS, type UnitName } from "../store/units";
import { useDraft } from "./draft";

interface Props {
  label: string;
  /** Where its value is in the request; changes are marked, and what was typed is kept. */
  pointer: Pointer;
  value: unknown;
  unit: UnitName;
  /** Instead of writing the value at the pointer. */
  onValue?: (value: number, text: string) => void;
  /** What is pasted, if it is more than a number; true if it was taken. */
  onPaste?: (text: string) => boolean;
  withUnit?: boolean;
  id?: string;
}

/** A number of the request in its unit, as it was typed. */
export function NumberCell({ label, pointer, value, unit, onValue, onPaste, withUnit, id }: Props) {
  const [wrong, setWrong] = useState<string | null>(null);
  const { sign } = UNITS[unit];
  const isWrong = wrong !== null;
  useEffect(() => {
    if (!isWrong) return;
    unread.value = { ...unread.value, [pointer]: label };
    return () => {
      const { [pointer]: _, ...others } = unread.value;
      unread.value = others;
    };
  }, [isWrong, pointer, label]);
  const own = typed.value[pointer];
  const same = own !== undefined && isSame(typedValue(own, unit), value);
  const text = wrong ?? (same ? own : shown(value, unit));
  const change = changes.value.find((each) => each.pointer === pointer);
  const bad = isWrong || trouble.value?.fields.some((each) => each.pointer === pointer);
  const { field, end } = useDraft(text);
  const commit = (next: string) => {
    end();
    const number = typedValue(next, unit);
    if (number === null) {
      setWrong(next);
      return;
    }
    setWrong(null);
    if (next === text) return;
    if (onValue) onValue(number, next);
    else write(pointer, number, next);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const input = event.currentTarget as HTMLInputElement;
    const up = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (event.key === "Enter" && !event.ctrlKey && !event.metaKey) commit(input.value);
    if (!up) return;
    event.preventDefault();
    if (typedValue(input.value, unit) === null) return;
    commit(stepped(input.value, up * (event.shiftKey ? 10 : 1)));
  };
  return (
    <span
      class={`number-cell${change ? " changed" : ""}`}
      title={change ? `was ${change.before}` : undefined}
    >
      <input
        type="text"
        inputMode="decimal"
        id={id}
        {...field}
        data-pointer={pointer}
        aria-label={sign ? `${label} in ${sign}` : label}
        aria-invalid={bad ? "true" : undefined}
        onChange={(event) => commit(event.currentTarget.value)}
        onFocus={(event) => event.currentTarget.select()}
        onKeyDown={onKeyDown}
        onPaste={(event) => {
          if (onPaste?.(event.clipboardData?.getData("text/plain") ?? "")) event.preventDefault();
        }}
      />
      {withUnit && sign && <small>{sign}</small>}
      {isWrong && (
        <small class="error" role="alert">
          Not a number
        </small>
      )}
    </span>
  );
}

const isSame = (a: number | null, b: unknown) =>
  a !== null && typeof b === "number" && Math.abs(a - b) <= 1e-9 * Math.max(1, Math.abs(a));

/** A number as text, so many units of its last digit further. */
function stepped(text: string, steps: number): string {
  const plain = text.replace("−", "-").replace(",", ".");
  const digits = plain.split(".")[1]?.length ?? 0;
  return (Number(plain) + steps / 10 ** digits).toFixed(digits).replace("-", "−");
}
