import { useEffect, useRef, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { get, patch, remove } from "../store/client";
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
const PAUSE = 250; // after the last letter of a search [ms]
const OPENED = ["optimize", "cycle"]; // endpoints whose answers are drawn
const OF_LOGS = ["identify", "residuals"]; // answers of identifications, which have a list of their own

const kindOf = (kind: string) => ({ optimize: "move", cycle: "round" })[kind] ?? words(kind);

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
  const [answers, setAnswers] = useState<Kept[]>([]);
  const [next, setNext] = useState<string | null>(null);
  const [search, setSearch] = useState("");
  const latest = useRef(0);
  const load = async (after?: string) => {
    const mine = ++latest.current;
    const query = new URLSearchParams({ whole: "true", limit: `${MOST}` });
    const text = search.trim();
    if (text) query.set("search", /^rounds?$/i.test(text) ? "cycle" : text);
    if (after) query.set("after", after);
    const page = await get<{ answers: Kept[]; next: string | null }>(`answers?${query}`);
    if (mine !== latest.current) return;
    const own = page.answers.filter(({ kind }) => !OF_LOGS.includes(kind));
    setAnswers((before) => (after ? [...before, ...own] : own));
    setNext(page.next);
  };
  useEffect(() => {
    const timer = setTimeout(() => void load().catch((error) => tell(error)), search ? PAUSE : 0);
    return () => clearTimeout(timer);
  }, [search]);
  const drop = async (id: string) => {
    await remove(`answers/${id}`);
    setAnswers((before) => before.filter((each) => each.id !== id));
  };
  const rename = async (id: string, name: string) => {
    const renamed = await patch<Kept>(`answers/${id}`, { name: name.trim() || null });
    setAnswers((before) => before.map((each) => (each.id === id ? renamed : each)));
  };
  return (
    <section aria-label="Answers">
      <h2>Answers</h2>
      <input
        type="search"
        class="search"
        aria-label="Search answers"
        placeholder="Search by name, robot or kind"
        value={search}
        onInput={(event) => setSearch(event.currentTarget.value)}
      />
      <ul class="kept" id="answers">
        {answers.map((each) => (
          <Row
            key={each.id}
            kept={each}
            onDelete={trying(() => drop(each.id))}
            onRename={(name) => void trying(() => rename(each.id, name))()}
          />
        ))}
      </ul>
      {!answers.length && <p class="hint">{search ? "no answer of this name" : "none"}</p>}
      {next && <Button onClick={trying(() => load(next))}>Older</Button>}
    </section>
  );
}

interface RowProps {
  kept: Kept;
  onDelete: () => unknown;
  onRename: (name: string) => void;
}

function Row({ kept, onDelete, onRename }: RowProps) {
  const [naming, setNaming] = useState(false);
  const name = kept.name ?? `${kindOf(kept.kind)} ${kept.id.slice(0, 8)}`;
  if (naming)
    return (
      <li>
        <input
          type="text"
          class="search"
          aria-label={`New name of ${name}`}
          maxLength={200}
          value={kept.name ?? ""}
          ref={(input) => input?.focus()}
          onChange={(event) => onRename(event.currentTarget.value)}
          onBlur={() => setNaming(false)}
          onKeyDown={({ key, currentTarget }) => {
            if (key === "Escape") currentTarget.value = kept.name ?? "";
            if (key === "Enter" || key === "Escape") currentTarget.blur();
          }}
        />
      </li>
    );
  return (
    <li>
      <button
        type="button"
        class="choice"
        disabled={!OPENED.includes(kept.kind)}
        onClick={trying(() => openKept(kept.id))}
      >
        <b>{name}</b>
        <small>{factsOf(kept)}</small>
      </button>
      <Button kind="quiet" icon="pencil" label={`Rename ${name}`} onClick={() => setNaming(true)} />
      <Button kind="quiet" icon="trash" label={`Delete ${name}`} onClick={onDelete} />
    </li>
  );
}
