import { Errors } from "../ui/Errors";
import { NumberCell } from "../ui/NumberCell";
import { PlainNumber } from "../ui/PlainNumber";
import { Section } from "../ui/Section";
import { Segment } from "../ui/Segment";
import { at, put } from "../store/pointer";
import { isObject } from "../store/request";
import { answered, economics, edit, kind, request, typed } from "../store/state";
import type { ApiRequest } from "../store/types";

type Choice = "free" | "cycle" | "most" | "exact" | "other";

const TEXTS: Record<Choice, string> = {
  free: "Least energy",
  cycle: "Whole cycle",
  most: "At most",
  exact: "Exactly",
  other: "as in JSON",
};

function choiceOf(asked: ApiRequest, field: string): Choice {
  if (isObject(asked.dwell)) return "cycle";
  const given = at(asked, field);
  if (typeof given === "number") return "exact";
  if (!isObject(given)) return "free";
  return typeof given.max === "number" && (given.min ?? null) === null ? "most" : "other";
}

/** The request with another kind of time; the seconds are those of before, where there are any. */
export function withTime(asked: ApiRequest, choice: Choice, seconds: number): ApiRequest {
  const round = asked.stops !== undefined;
  const field = round ? "/time" : "/duration";
  const free = put(put(asked, field, undefined), "/dwell", undefined);
  if (choice === "cycle")
    return put(free, "/dwell", { ...(isObject(asked.dwell) ? asked.dwell : {}), time: seconds });
  if (choice === "most") return put(free, field, { max: seconds });
  return choice === "exact" ? put(free, field, seconds) : free;
}

/** How long the motion may take, and how often it comes. */
export function TimeField() {
  const asked = request.value;
  const round = kind.value === "round";
  const field = round ? "/time" : "/duration";
  const choice = choiceOf(asked, field);
  const seconds = { cycle: "/dwell/time", most: `${field}/max`, exact: field, free: "", other: "" }[
    choice
  ];
  const options: Choice[] = [
    ...(["free", ...(round ? [] : ["cycle"]), "most", "exact"] as Choice[]),
    ...(choice === "other" ? (["other"] as Choice[]) : []),
  ];
  const usual = () => {
    const now =
      (at(asked, seconds) as number | undefined) ?? answered.value?.solution.duration ?? 2;
    return Math.ceil(now * 100) / 100;
  };
  const choose = (next: Choice) => {
    if (next === "other" || next === choice) return;
    const cycle = economics.value.cycle;
    edit(withTime(asked, next, next === "cycle" && cycle ? cycle : usual()), typed.value);
  };
  return (
    <Section title="Time" action={<Every />}>
      <Segment
        label="Time"
        value={choice}
        onChange={choose}
        options={options.map((value) => ({ value, text: TEXTS[value] }))}
      />
      {seconds && (
        <div class="field">
          <span>{choice === "cycle" ? "from start to start" : "seconds"}</span>
          <NumberCell label="Time" pointer={seconds} value={at(asked, seconds)} unit="s" withUnit />
        </div>
      )}
      <Errors under={field} />
      <Errors under="/dwell" />
    </Section>
  );
}

/** "One move every … s": it prices the wait, and changes nothing of the motion. */
function Every() {
  return (
    <span class="every">
      one {kind.value === "round" ? "round" : "move"} every{" "}
      <PlainNumber
        label="One move every so many seconds"
        unit="s"
        value={economics.value.cycle}
        least="above zero"
        empty="–"
        onValue={(cycle) => (economics.value = { ...economics.value, cycle })}
      />
    </span>
  );
}
