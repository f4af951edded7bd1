import { useEffect, useState } from "preact/hooks";
import { KeptRow } from "../ui/KeptRow";
import { remove } from "../store/client";
import { forgetRobot, robotList, type RobotSummary } from "../store/service";
import { trouble } from "../store/state";
import { tell } from "../store/trouble";
import { Answers } from "./Answers";
import { Studies } from "./Studies";

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
          <KeptRow key={name} name={title} facts={name} onDelete={() => drop(name)} />
        ))}
      </ul>
    </section>
  );
}
