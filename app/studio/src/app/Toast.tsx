import { useEffect } from "preact/hooks";
import { toast } from "../store/state";

const LASTS = 6000; // [ms]

/** A remark that goes away by itself. */
export function Toast() {
  const text = toast.value;
  useEffect(() => {
    if (!text) return undefined;
    const timer = setTimeout(() => (toast.value = ""), LASTS);
    return () => clearTimeout(timer);
  }, [text]);
  return (
    <p class="toast" id="status" role="status" aria-live="polite">
      {text}
    </p>
  );
}
