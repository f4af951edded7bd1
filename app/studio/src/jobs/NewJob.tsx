import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Dialog } from "../ui/Dialog";
import { robotNow } from "../picture/pictured";
import { post } from "../store/client";
import { moveName, parseMoves, requestsOf } from "../store/moves";
import { keepJob } from "../store/persist";
import { robotName } from "../store/request";
import { request, project } from "../store/state";
import { figure } from "../store/units";
import { loadJob, loadJobs, refusal, type Job } from "./model";

const SAMPLE = "from; to; kg; x mm; y; z; rx rad; ry; rz; x mm; y; z; rx; ry; rz";
const SHOWN = 5;

/** A table of moves becomes a job in the current cell. */
export function NewJob({ onClose }: { onClose: () => void }) {
  const [text, setText] = useState("");
  const [source, setSource] = useState("a pasted table");
  const [name, setName] = useState("Moves");
  const [chosen, setChosen] = useState(-1);
  const [why, setWhy] = useState("");
  const [busy, setBusy] = useState(false);
  const joints = robotNow.value?.joints.length ?? 6;
  const read = text.trim() ? parseMoves(text, joints) : null;
  const choices = read && "choices" in read ? read.choices : [];
  const choice = choices.length === 1 ? choices[0] : choices[chosen];
  const moves = read && "moves" in read ? read.moves : [];
  const start = async () => {
    setBusy(true);
    setWhy("");
    try {
      const requests = requestsOf(moves, choice!, request.value);
      const bodies = requests.map((each, k) => ({
        name: moveName(moves[k]!),
        optimize: { ...each, candidates: "none" },
      }));
      const { id } = await post<Job>("jobs", { name, requests: bodies });
      const masses = moves.map(({ mass }) => mass);
      await keepJob({ id, source, masses, requests }).catch(() => undefined);
      await loadJobs();
      await loadJob(id);
      onClose();
    } catch (error) {
      setWhy(refusal(error));
    } finally {
      setBusy(false);
    }
  };
  const take = async (file: File | undefined) => {
    if (!file) return;
    setText(await file.text());
    setChosen(-1);
    setWhy("");
    setSource(file.name);
    setName(file.name.replace(/\.\w+$/, ""));
  };
  return (
    <Dialog
      title="New job"
      wide
      onClose={onClose}
      footer={
        <>
          <span class="hint">
            In the cell “{project.value.name}”: {robotName(request.value)},{" "}
            {request.value.scene?.obstacles?.length ?? 0} obstacles.
          </span>
          <span class="space" />
          <Button onClick={onClose}>Cancel</Button>
          <Button
            kind="primary"
            id="start-job"
            disabled={!choice || !moves.length || busy}
            onClick={start}
          >
            Start {moves.length === 1 ? "1 move" : `${moves.length || ""} moves`}
          </Button>
        </>
      }
    >
      <div class="fields">
        <label>
          Name{" "}
          <input
            type="text"
            value={name}
            onInput={(event) => {
              setName(event.currentTarget.value);
              setWhy("");
            }}
          />
        </label>
        <label>
          A CSV file{" "}
          <input
            type="file"
            id="moves-file"
            accept=".csv,.txt,.tsv"
            onChange={(event) => void take(event.currentTarget.files?.[0])}
          />
        </label>
        <label>
          or paste one move per row
          <textarea
            id="moves-text"
            rows={9}
            spellcheck={false}
            placeholder={SAMPLE}
            value={text}
            onInput={(event) => {
              setText(event.currentTarget.value);
              setChosen(-1);
              setWhy("");
            }}
          />
        </label>
        <p class="hint">
          Names and masses are optional, and joint positions may replace poses. With one target per
          row, each move leads from one row to the next.
        </p>
        {read && "why" in read && (
          <p class="error" role="alert">
            {read.why}
          </p>
        )}
        {why && (
          <p class="error" role="alert" id="job-error">
            {why}
          </p>
        )}
        {choices.length > 1 && (
          <div class="row" id="job-readings">
            <b>How should this be read?</b>
            {choices.map(({ echo }, k) => (
              <Button key={echo} small pressed={k === chosen} onClick={() => setChosen(k)}>
                {echo}
              </Button>
            ))}
          </div>
        )}
        {choice && moves.length > 0 && (
          <>
            <p>
              {moves.length} moves, read as {choice.echo}.
            </p>
            <ul class="hint">
              {moves.slice(0, SHOWN).map((move, k) => (
                <li key={k}>
                  {moveName(move)}
                  {move.mass === null ? "" : `, ${figure(move.mass)} kg`}
                </li>
              ))}
            </ul>
          </>
        )}
      </div>
    </Dialog>
  );
}
