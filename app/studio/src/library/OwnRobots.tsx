import { useEffect, useRef, useState } from "preact/hooks";
import { KeptRow } from "../ui/KeptRow";
import { SearchField } from "../ui/SearchField";
import { patch, remove } from "../store/client";
import { robotNow } from "../picture/pictured";
import { forgetRobot, knowRobot, robotList, type RobotSummary } from "../store/service";
import { tell } from "../store/trouble";
import type { Robot } from "../store/types";

/** Robots of one's own, by their titles; their names in requests stay. */
export function OwnRobots() {
  const [all, setAll] = useState<RobotSummary[] | null>(null);
  const [search, setSearch] = useState("");
  const latest = useRef(0);
  const load = async () => {
    const mine = ++latest.current;
    const robots = await robotList(search);
    if (mine === latest.current) setAll(robots.filter(({ added }) => added));
  };
  useEffect(() => {
    load().catch((error) => tell(error));
  }, [search]);
  const pathOf = (name: string) => `robots/${encodeURIComponent(name)}`;
  const rename = async (name: string, title: string | null) => {
    const renamed = await patch<Robot>(pathOf(name), { title });
    knowRobot(renamed);
    if (robotNow.peek()?.name === name) robotNow.value = renamed;
    await load();
  };
  const drop = async (name: string) => {
    await remove(pathOf(name));
    forgetRobot(name);
    await load();
  };
  return (
    <section aria-label="Your robots">
      <h2>Your robots</h2>
      <SearchField
        label="Search your robots"
        placeholder="Search by name or title"
        onSearch={setSearch}
      />
      <ul class="kept" id="own-robots">
        {all?.map(({ name, title, joints }) => (
          <KeptRow
            key={name}
            name={title}
            facts={`${name} · ${joints.length} joints`}
            onRename={(given) => rename(name, given)}
            onDelete={() => drop(name)}
          />
        ))}
      </ul>
      {all?.length === 0 && (
        <p class="hint">
          {search ? "No robot has this name." : "No robot yet: add one in the picker of a cell."}
        </p>
      )}
    </section>
  );
}
