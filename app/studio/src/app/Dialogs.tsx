import { useState } from "preact/hooks";
import { ExportDialog } from "../export/ExportDialog";
import { Others } from "../export/Others";
import { Button } from "../ui/Button";
import { Dialog } from "../ui/Dialog";
import { alone } from "../store/alone";
import { keyAsked } from "../store/client";
import { answered } from "../store/state";
import { dialog } from "./dialog";
import { KEYS } from "./keys";
import { ProjectsDialog } from "./ProjectsDialog";

/** The dialog that is open, if there is one. */
export function Dialogs() {
  const close = () => (dialog.value = null);
  return (
    <>
      {keyAsked.value && <KeyDialog />}
      {dialog.value === "export" &&
        answered.value &&
        (alone ? (
          <Dialog title="Files" onClose={close}>
            <Others />
          </Dialog>
        ) : (
          <ExportDialog onClose={close} />
        ))}
      {dialog.value === "projects" && <ProjectsDialog onClose={close} />}
      {dialog.value === "keys" && (
        <Dialog title="Keyboard shortcuts" onClose={close}>
          <dl class="keys">
            {KEYS.map(([keys, effect]) => (
              <div key={keys}>
                <dt>
                  <kbd>{keys}</kbd>
                </dt>
                <dd>{effect}</dd>
              </div>
            ))}
          </dl>
        </Dialog>
      )}
    </>
  );
}

function KeyDialog() {
  const [key, setKey] = useState("");
  const give = keyAsked.value!;
  return (
    <Dialog
      title="This service needs an API key"
      onClose={() => give(null)}
      footer={
        <Button kind="primary" onClick={() => give(key.trim() || null)}>
          Use key
        </Button>
      }
    >
      <label class="field">
        Key
        <input
          id="key"
          type="password"
          autocomplete="off"
          value={key}
          onInput={(event) => setKey(event.currentTarget.value)}
          onKeyDown={(event) => event.key === "Enter" && give(key.trim() || null)}
        />
      </label>
      <p class="hint">The key is kept until this tab is closed.</p>
    </Dialog>
  );
}
