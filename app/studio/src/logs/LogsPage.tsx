import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { KeptRow } from "../ui/KeptRow";
import { SearchField } from "../ui/SearchField";
import { patch, remove } from "../store/client";
import { trouble } from "../store/state";
import { tell, trying } from "../store/trouble";
import { figure, when } from "../store/units";
import { AddLog } from "./AddLog";
import { Identification } from "./Identification";
import { LogView } from "./LogView";
import {
  busy,
  chosen,
  identifications,
  identify,
  loadLogs,
  logs,
  logSearch,
  openedIdentification,
  openedLog,
  openIdentification,
  openLog,
} from "./model";

/** Logs of the user's arm: measured and predicted energy, and figures identified from them. */
export function LogsPage() {
  const [file, setFile] = useState<File | null>(null);
  useEffect(() => {
    trouble.value = null;
    loadLogs().catch((error) => tell(error));
  }, []);
  const shown = logs.value ?? [];
  const flip = (id: string) =>
    (chosen.value = chosen.value.includes(id)
      ? chosen.value.filter((each) => each !== id)
      : [...chosen.value, id]);
  const drop = async (id: string) => {
    await remove(`logs/${id}`);
    chosen.value = chosen.value.filter((each) => each !== id);
    if (openedLog.value?.id === id) openedLog.value = null;
    await loadLogs();
  };
  const forget = async (id: string) => {
    await remove(`identifications/${id}`);
    if (openedIdentification.value?.found.id === id) openedIdentification.value = null;
    await loadLogs();
  };
  const renameLog = async (id: string, name: string | null) => {
    await patch(`logs/${id}`, { name });
    if (openedLog.value?.id === id) openedLog.value = { ...openedLog.value, name };
    await loadLogs();
  };
  const rename = async (id: string, name: string | null) => {
    await patch(`identifications/${id}`, { name });
    const { value } = openedIdentification;
    if (value?.found.id === id)
      openedIdentification.value = { ...value, found: { ...value.found, name } };
    await loadLogs();
  };
  return (
    <main class="page with-list" id="logs">
      <aside class="side" aria-label="Logs">
        <label class="button primary">
          Add a log …
          <input
            type="file"
            class="unseen"
            id="log-file"
            accept=".csv,.gz,.txt"
            onChange={(event) => {
              setFile(event.currentTarget.files?.[0] ?? null);
              event.currentTarget.value = "";
            }}
          />
        </label>
        <SearchField
          label="Search logs and identifications"
          placeholder="Search by name or robot"
          onSearch={(text) => {
            logSearch.value = text;
            loadLogs().catch((error) => tell(error));
          }}
        />
        {logs.value && !shown.length && (
          <p class="hint">
            {logSearch.value
              ? "No log has this name."
              : "No log yet: add a CSV file of your arm (RTDE, ROS, or t, q1 …)."}
          </p>
        )}
        <ul class="kept">
          {shown.map((log) => (
            <KeptRow
              key={log.id}
              name={log.name}
              unnamed={log.id.slice(0, 8)}
              facts={`${log.robot} · ${figure(log.duration)} s · ${when(log.created)}`}
              current={openedLog.value?.id === log.id && !openedIdentification.value}
              onOpen={() => openLog(log.id)}
              onRename={(name) => renameLog(log.id, name)}
              onDelete={() => drop(log.id)}
              before={
                <input
                  type="checkbox"
                  aria-label={`Use ${log.name ?? log.id} for an identification`}
                  checked={chosen.value.includes(log.id)}
                  onChange={() => flip(log.id)}
                />
              }
            />
          ))}
        </ul>
        <Button
          id="identify"
          disabled={!chosen.value.length || Boolean(busy.value)}
          title="Identify friction, rotors and power of your own arm"
          onClick={trying(() => identify(chosen.value))}
        >
          Identify from {chosen.value.length} {chosen.value.length === 1 ? "log" : "logs"}
        </Button>
        {busy.value && (
          <div role="status" id="identifying">
            <p class="hint">{busy.value.text}</p>
            {busy.value.share !== null && (
              <progress max={1} value={busy.value.share} aria-label="Completed fits" />
            )}
          </div>
        )}
        <h2>Identifications</h2>
        {!identifications.value.length && (
          <p class="hint">
            {logSearch.value ? "No identification has this name." : "No identification yet."}
          </p>
        )}
        <ul class="kept">
          {identifications.value.map((each) => (
            <KeptRow
              key={each.id}
              name={each.name}
              unnamed={`${each.robot ?? "identification"} ${each.id.slice(0, 8)}`}
              facts={[each.robot, each.state, when(each.created)].filter(Boolean).join(" · ")}
              current={openedIdentification.value?.found.id === each.id}
              onOpen={() => openIdentification(each.id)}
              onRename={(name) => rename(each.id, name)}
              onDelete={() => forget(each.id)}
            />
          ))}
        </ul>
      </aside>
      <section class="content" aria-label="Log">
        <Wrong />
        {openedIdentification.value ? (
          <Identification />
        ) : openedLog.value ? (
          <LogView key={openedLog.value.id} log={openedLog.value} />
        ) : (
          <p class="empty">
            Choose a log to compare the measured and predicted energy of each move. Tick logs to
            identify the figures of your own arm.
          </p>
        )}
      </section>
      {file && <AddLog file={file} onClose={() => setFile((now) => (now === file ? null : now))} />}
    </main>
  );
}

function Wrong() {
  const now = trouble.value;
  return (
    now && (
      <p class="error" role="alert" id="problem">
        <b>{now.title}.</b> {now.text} {now.link && <a href={now.link}>What this means</a>}
      </p>
    )
  );
}
