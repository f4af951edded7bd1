import { useEffect, useRef } from "preact/hooks";
import { trouble } from "../store/state";
import type { Pointer } from "../store/pointer";

/** What the service says of a field and of those below it; a group that was shut opens. */
export function Errors({ under, except }: { under: Pointer; except?: Pointer[] }) {
  const own = (trouble.value?.fields ?? []).filter(
    ({ pointer }) =>
      (pointer === under || pointer.startsWith(`${under}/`)) &&
      !except?.some((each) => pointer.startsWith(each)),
  );
  const first = useRef<HTMLParagraphElement>(null);
  useEffect(() => {
    let shut = first.current?.closest("details");
    for (; shut; shut = shut.parentElement?.closest("details")) shut.open = true;
  }, [own.map(({ text }) => text).join()]);
  return (
    <>
      {own.map(({ text }, k) => (
        <p class="error" role="alert" key={text} ref={k ? undefined : first}>
          {text}
        </p>
      ))}
    </>
  );
}
