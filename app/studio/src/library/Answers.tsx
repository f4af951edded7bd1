import { useEffect, useRef, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { KeptRow } from "../ui/KeptRow";
import { SearchField } from "../ui/SearchField";
import { listed, patch, remove } from "../store/client";
import { openKept } from "../store/open";
import { tell, trying } from "../store/trouble";
import { figure, when, words } from "../store/units";

interface Kept {
  id: string;
  name: string | null;
  kind: string;
  created: string;
  robot: string | null;
  energy: number | null;
  duration: number | null;
}

const MOST = 50;
const OPENED = ["optimize", "cycle"]; // endpoints whose answers are drawn
const OF_LOGS = ["identify", "residuals"]; // answers of identifications, which have a list of their own

const kindOf = (kind: string) => (kind === "optimize" ? "move" : words(kind));

const factsOf = ({ kind, energy, duration, robot, created }: Kept) =>
  [
    kindOf(kind),
    robot,
    energy !== null && `${figure(energy)} J, ${figure(duration)} s`,
    when(created),
  ]
    .filter(Boolean)
    .join(" · ");

/** Answers of their own, by name: those of jobs and studies are with them. */
export function Answers() {
  const [answers, setAnswers] = useState<Kept[] | null>(null);
  const [next, setNext] = useState<string | null>(null);
  const [search, setSearch] = useState("");
  const latest = useRef(0);
  const load = async (after?: string) => {
    const mine = ++latest.current;
    const query = { whole: "true", limit: `${MOST}`, search, after };
    const page = await listed<{ answers: Kept[]; next: string | null }>("answers", query);
    if (mine !== latest.current) return;
    const own = page.answers.filter(({ kind }) => !OF_LOGS.includes(kind));
    setAnswers((before) => (after ? [...(before ?? []), ...own] : own));
    setNext(page.next);
  };
  useEffect(() => {
    load().catch((error) => tell(error));
  }, [search]);
  const drop = async (id: string) => {
    await remove(`answers/${id}`);
    setAnswers((before) => before?.filter((each) => each.id !== id) ?? null);
  };
  const rename = async (id: string, name: string | null) => {
    const renamed = await patch<Kept>(`answers/${id}`, { name });
    setAnswers((before) => before?.map((each) => (each.id === id ? renamed : each)) ?? null);
  };
  return (
    <section aria-label="Answers">
      <h2>Answers</h2>
      <SearchField
        label="Search answers"
        placeholder="Search by name, robot or kind"
        onSearch={setSearch}
      />
      <ul class="kept" id="answers">
        {answers?.map((each) => (
          <KeptRow
            key={each.id}
            name={each.name}
            unnamed={`${kindOf(each.kind)} ${each.id.slice(0, 8)}`}
            facts={factsOf(each)}
            onOpen={OPENED.includes(each.kind) ? () => openKept(each.id) : undefined}
            onRename={(name) => rename(each.id, name)}
            onDelete={() => drop(each.id)}
          />
        ))}
      </ul>
      {answers?.length === 0 && (
        <p class="hint">{search ? "No answer has this name." : "No answer yet."}</p>
      )}
      {next && <Button onClick={trying(() => load(next))}>Older</Button>}
    </section>
  );
}
