import { trouble } from "../store/state";
import type { Pointer } from "../store/pointer";

/** What the service says of a field and of those below it. */
export function Errors({ under, except }: { under: Pointer; except?: Pointer[] }) {
  const own = (trouble.value?.fields ?? []).filter(
    ({ pointer }) =>
      (pointer === under || pointer.startsWith(`${under}/`)) &&
      !except?.some((each) => pointer.startsWith(each)),
  );
  return (
    <>
      {own.map(({ text }) => (
        <p class="error" role="alert" key={text}>
          {text}
        </p>
      ))}
    </>
  );
}
