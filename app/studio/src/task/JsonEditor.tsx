import { useEffect, useState } from "preact/hooks";
import { parsed } from "../store/share";
import { edit, jsonBroken, request } from "../store/state";

/** The same request as JSON. What is no request is kept, and cannot be sent. */
export function JsonEditor() {
  const text = JSON.stringify(request.value, null, 1);
  const [own, setOwn] = useState<string | null>(null);
  const [why, setWhy] = useState("");
  useEffect(() => {
    setOwn(null);
    setWhy("");
    jsonBroken.value = false;
  }, [text]);
  const read = (given: string) => {
    try {
      const next = parsed(given);
      jsonBroken.value = false;
      setWhy("");
      if (JSON.stringify(next) !== JSON.stringify(request.value)) edit(next);
    } catch (error) {
      setOwn(given);
      setWhy((error as Error).message);
      jsonBroken.value = true;
    }
  };
  return (
    <div class="json">
      <textarea
        id="json"
        spellcheck={false}
        aria-label="Request as JSON"
        aria-invalid={why ? "true" : undefined}
        value={own ?? text}
        onChange={(event) => read(event.currentTarget.value)}
      />
      {why && (
        <p class="error" role="alert" id="json-error">
          This is not a request. {why}
        </p>
      )}
    </div>
  );
}
