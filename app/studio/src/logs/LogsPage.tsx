import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { remove } from "../store/client";
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
  openedIdentification,
  openedLog,
  openIdentification,
  openLog,
} from "./model";

/** Logs of one's own arm: measured against predicted joules, and figures found from them. */
export function LogsPage() {
  const [filter, setFilter] = useState("");
  const [file, setFile] = useState<File | null>(null);
  useEffect(() => {
    trouble.value = null;
    loadLogs().catch((error) => tell(error));
  }, []);
  const shown = (logs.value ?? []).filter(({ name, robot, id }) =>
    `${name ?? ""} ${robot} ${id}`.toLowerCase().includes(filter.toLowerCase()),
  );
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
    await remove(`jobs/${id}`);
    if (openedIdentification.value?.found.id === id) openedIdentification.value = null;
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
        <input
          type="search"
          class="search"
          aria-label="Search logs"
          placeholder="Search logs"
          value={filter}
          onInput={(event) => setFilter(event.currentTarget.value)}
        />
        {logs.value && !shown.length && (
          <p class="hint">No log yet: add a CSV file of your arm (RTDE, ROS, or t, q1 …).</p>
        )}
        <ul class="kept">
          {shown.map((log) => (
            <li key={log.id}>
              <input
                type="checkbox"
                aria-label={`Use ${log.name ?? log.id} for an identification`}
                checked={chosen.value.includes(log.id)}
                onChange={() => flip(log.id)}
              />
              <button
                type="button"
                class="choice"
                aria-current={
                  openedLog.value?.id === log.id && !openedIdentification.value ? "true" : undefined
                }
                onClick={trying(() => openLog(log.id))}
              >
                <b>{log.name ?? log.id.slice(0, 8)}</b>
                <small>
                  {log.robot} · {figure(log.duration)} s · {when(log.created)}
                </small>
              </button>
              <Button
                kind="quiet"
                icon="trash"
                label={`Delete ${log.name ?? log.id}`}
                onClick={trying(() => drop(log.id))}
              />
            </li>
          ))}
        </ul>
        <Button
          id="identify"
          disabled={!chosen.value.length || Boolean(busy.value)}
          title="Friction, rotors, power of your own arm"
          onClick={trying(() => identify({ logs: chosen.value }))}
        >
          Identify from {chosen.value.length} {chosen.value.length === 1 ? "log" : "logs"}
        </Button>
        {busy.value && (
          <p class="hint" role="status">
            {busy.value}
          </p>
        )}
        <h2>Identifications</h2>
        {!identifications.value.length && <p class="hint">None yet.</p>}
        <ul class="kept">
          {identifications.value.map((each) => (
            <li key={each.id}>
              <button
                type="button"
                class="choice"
                onClick={trying(() => openIdentification(each.id))}
              >
                <b>{each.robot ?? each.id.slice(0, 8)}</b>
                <small>
                  {each.state} · {when(each.created)}
                </small>
              </button>
              <Button
                kind="quiet"
                icon="trash"
                label={`Delete the identification of ${when(each.created)}`}
                onClick={trying(() => forget(each.id))}
              />
            </li>
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
            Choose a log to see measured against predicted joules of each move; tick logs to
            identify the figures of your own arm.
          </p>
        )}
      </section>
      {file && <AddLog file={file} onClose={() => setFile(null)} />}
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
