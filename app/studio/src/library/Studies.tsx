import { useEffect, useRef, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { KeptRow } from "../ui/KeptRow";
import { SearchField } from "../ui/SearchField";
import { get, listed, patch, remove } from "../store/client";
import { openKept } from "../store/open";
import { tell } from "../store/trouble";
import { figure, when } from "../store/units";

interface Study {
  id: string;
  name: string;
  robot: string;
  created: string;
  iterations: number;
}

interface Iteration {
  number: number;
  kind?: string;
  energy?: number | null;
  answer?: string | null;
}

const MOST = 200;
const MOST_ITERATIONS = 50;

/** Studies by name, and the iterations of one of them. */
export function Studies() {
  const [all, setAll] = useState<Study[] | null>(null);
  const [search, setSearch] = useState("");
  const [opened, setOpened] = useState<{ name: string; rows: Iteration[] } | null>(null);
  const latest = useRef(0);
  const load = async () => {
    const mine = ++latest.current;
    const found = await listed<{ studies: Study[] }>("studies", { limit: `${MOST}`, search });
    if (mine === latest.current) setAll(found.studies);
  };
  useEffect(() => {
    load().catch((error) => tell(error));
  }, [search]);
  const open = async ({ id, name }: Study) =>
    setOpened({ name, rows: (await get<{ history: Iteration[] }>(`studies/${id}`)).history });
  const title = ({ number, kind, energy }: Iteration) =>
    `${number}: ${kind ?? ""} ${energy == null ? "no energy" : `${figure(energy)} J`}`;
  if (opened)
    return (
      <section aria-label="Studies">
        <h2>{opened.name}</h2>
        <Button small onClick={() => setOpened(null)}>
          ← all studies
        </Button>
        <ul class="kept" id="iterations">
          {opened.rows.slice(-MOST_ITERATIONS).map((row) => (
            <KeptRow
              key={row.number}
              name={title(row)}
              facts={row.answer ? "" : "no stored answer"}
              onOpen={row.answer ? () => openKept(row.answer!) : undefined}
            />
          ))}
        </ul>
      </section>
    );
  return (
    <section aria-label="Studies">
      <h2>Studies</h2>
      <SearchField
        label="Search studies"
        placeholder="Search by name or robot"
        onSearch={setSearch}
      />
      <ul class="kept" id="studies">
        {all?.map((study) => (
          <KeptRow
            key={study.id}
            name={study.name}
            facts={`${study.robot} · ${study.iterations} iterations · ${when(study.created)}`}
            onOpen={() => open(study)}
            onRename={async (name) => {
              if (name) await patch(`studies/${study.id}`, { name });
              await load();
            }}
            onDelete={async () => {
              await remove(`studies/${study.id}`);
              await load();
            }}
          />
        ))}
      </ul>
      {all?.length === 0 && (
        <p class="hint">{search ? "No study has this name." : "No study yet."}</p>
      )}
    </section>
  );
}
