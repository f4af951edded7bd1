import { useEffect } from "preact/hooks";
import { AnswerPanel } from "../answer/AnswerPanel";
import { Dock } from "../charts/Dock";
import { JobsPage } from "../jobs/JobsPage";
import { LibraryPage } from "../library/LibraryPage";
import { LogsPage } from "../logs/LogsPage";
import { Picture } from "../picture/Picture";
import { Player } from "../picture/Player";
import { PlacementPanel } from "../placement/PlacementPanel";
import { TaskPanel } from "../task/TaskPanel";
import { Tabs } from "../ui/Tabs";
import { alone } from "../store/alone";
import { answered, page, placing, stale, tab } from "../store/state";
import { figure } from "../store/units";
import { Dialogs } from "./Dialogs";
import { onKey } from "./keys";
import { Reports } from "./Reports";
import { Toast } from "./Toast";
import { TopBar } from "./TopBar";

const TABS = [
  { value: "task", text: "Task" },
  { value: "picture", text: "Picture" },
  { value: "answer", text: "Answer" },
] as const;
const WITH_PLACES = [...TABS.slice(0, 2), { value: "answer", text: "Places" }] as const;

/** The whole page. */
export function App() {
  useEffect(() => {
    document.addEventListener("keydown", onKey);
    return () => document.removeEventListener("keydown", onKey);
  }, []);
  const shown = answered.value;
  useEffect(() => {
    const { solution } = shown ?? {};
    document.title =
      solution && !stale.value
        ? `${figure(solution.energy[solution.objective].total)} J in ${figure(solution.duration)} s · joulepath studio`
        : "joulepath studio";
  }, [shown, stale.value]);
  return (
    <div class={`app${alone ? " alone" : ""}`} data-tab={tab.value}>
      <a class="skip" href="#view">
        Skip to the motion
      </a>
      <TopBar />
      <main class="work" hidden={page.value !== "cell"} id="cell">
        {!alone && <TaskPanel />}
        <section class="stage" aria-label="Motion">
          <Picture />
          <Player />
          {!placing.value && <Dock />}
        </section>
        {placing.value ? <PlacementPanel /> : <AnswerPanel />}
      </main>
      {page.value === "jobs" && <JobsPage />}
      {page.value === "logs" && <LogsPage />}
      {page.value === "library" && <LibraryPage />}
      {page.value === "cell" && (
        <nav class="bottom" aria-label="Parts of the cell">
          <Tabs
            label="Parts of the cell"
            options={alone ? TABS.slice(1) : placing.value ? WITH_PLACES : TABS}
            value={tab.value}
            onChange={(next) => (tab.value = next)}
          />
        </nav>
      )}
      <Dialogs />
      <Reports />
      <Toast />
    </div>
  );
}
