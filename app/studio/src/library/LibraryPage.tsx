import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { get, remove } from "../store/client";
import { openKept } from "../store/open";
import { forgetRobot, robotList, type RobotSummary } from "../store/service";
import { trouble } from "../store/state";
import { tell, trying } from "../store/trouble";
import { figure, when } from "../store/units";
import { Answers } from "./Answers";

interface Study {
  id: string;
  name: string;
  created: string;
  iterations: number;
}

interface Iteration {
  number: number;
  kind?: string;
  energy?: number | null;
  answer?: string | null;
}

const MOST = 50;

/** What the service keeps: answers, studies, and robots of one's own. */
export function LibraryPage() {
  useEffect(() => {
    trouble.value = null;
  }, []);
  return (
    <main class="page" id="library">
      {trouble.value && (
        <p class="error" role="alert" id="problem">
          {trouble.value.text}
        </p>
      )}
      <div class="columns">
        <Answers />
        <Studies />
        <OwnRobots />
      </div>
    </main>
  );
}

function Studies() {
  const [all, setAll] = useState<Study[]>([]);
  const [opened, setOpened] = useState<{ name: string; rows: Iteration[] } | null>(null);
  useEffect(() => {
    get<{ studies: Study[] }>(`studies?limit=${MOST}`).then(
      ({ studies }) => setAll(studies),
      (error) => tell(error),
    );
  }, []);
  const drop = async (id: string) => {
    await remove(`studies/${id}`);
    setAll((before) => before.filter((each) => each.id !== id));
  };
  const open = async ({ id, name }: Study) =>
    setOpened({ name, rows: (await get<{ history: Iteration[] }>(`studies/${id}`)).history });
  const title = ({ number, kind, energy }: Iteration) =>
    `${number}: ${kind ?? ""} ${energy == null ? "no energy" : `${figure(energy)} J`}`;
  return (
    <section aria-label="Studies">
      <h2>Studies</h2>
      {opened ? (
        <>
          <Button small onClick={() => setOpened(null)}>
            ← all
          </Button>
          <ul class="kept" id="iterations">
            {opened.rows.slice(0, MOST).map((row) => (
              <li key={row.number}>
                <button
                  type="button"
                  class="choice"
                  disabled={!row.answer}
                  onClick={trying(() => openKept(row.answer!))}
                >
                  <b>{title(row)}</b>
                  <small>{row.answer ? opened.name : "no kept answer"}</small>
                </button>
              </li>
            ))}
          </ul>
        </>
      ) : (
        <ul class="kept" id="studies">
          {all.map((study) => (
            <li key={study.id}>
              <button type="button" class="choice" onClick={trying(() => open(study))}>
                <b>{study.name}</b>
                <small>
                  {study.iterations} iterations · {when(study.created)}
                </small>
              </button>
              <Button
                kind="quiet"
                icon="trash"
                label={`Delete ${study.name}`}
                onClick={trying(() => drop(study.id))}
              />
            </li>
          ))}
        </ul>
      )}
      {!all.length && <p class="hint">none</p>}
    </section>
  );
}

function OwnRobots() {
  const [all, setAll] = useState<RobotSummary[]>([]);
  const load = () => robotList().then((robots) => setAll(robots.filter(({ added }) => added)));
  useEffect(() => {
    load().catch((error) => tell(error));
  }, []);
  const drop = async (name: string) => {
    await remove(`robots/${encodeURIComponent(name)}`);
    forgetRobot(name);
    await load();
  };
  return (
    <section aria-label="Your robots">
      <h2>Your robots</h2>
      {!all.length && <p class="hint">none: add one in the robot picker of a cell.</p>}
      <ul class="kept">
        {all.map(({ name, title }) => (
          <li key={name}>
            <span class="choice">
              <b>{title}</b>
              <small>{name}</small>
            </span>
            <Button
              kind="quiet"
              icon="trash"
              label={`Delete ${name}`}
              onClick={trying(() => drop(name))}
            />
          </li>
        ))}
      </ul>
    </section>
  );
}
