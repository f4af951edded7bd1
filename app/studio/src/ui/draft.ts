import { useState } from "preact/hooks";

/**
 * What is typed into a field before it counts: the text and the handlers of the field. Otherwise
 * whatever is drawn anew meanwhile would put its last text back.
 */
export function useDraft(text: string) {
  const [draft, setDraft] = useState<string | null>(null);
  const end = () => setDraft(null);
  const onInput = ({ currentTarget }: { currentTarget: HTMLInputElement }) =>
    setDraft(currentTarget.value);
  return { end, field: { value: draft ?? text, onInput, onBlur: end } };
}
