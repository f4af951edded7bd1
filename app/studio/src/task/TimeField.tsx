import { Errors } from "../ui/Errors";
import { NumberCell } from "../ui/NumberCell";
import { PlainNumber } from "../ui/PlainNumber";
import { Section } from "../ui/Section";
import { Segment } from "../ui/Segment";
import { at, put } from "../store/pointer";
import { isObject } from "../store/request";
import { answered, economics, edit, kind, request, typed } from "../store/state";
import type { ApiRequest } from "../store/types";

type Choice = "free" | "period" | "most" | "exact" | "other";

const TEXTS: Record<Choice, string> = {
  free: "Least energy",
  period: "Cycle time",
  most: "At most",
  exact: "Exactly",
  other: "as in JSON",
};

const fieldOf = (asked: ApiRequest) => (asked.stops === undefined ? "/duration" : "/time");

function choiceOf(asked: ApiRequest): Choice {
  if (isObject(asked.dwell)) return "period";
  const given = at(asked, fieldOf(asked));
  if (typeof given === "number") return "exact";
  if (!isObject(given)) return "free";
  return typeof given.max === "number" && (given.min ?? null) === null ? "most" : "other";
}

/** Where the seconds of a choice are in the request; null for one without. */
function secondsAt(asked: ApiRequest): string | null {
  const field = fieldOf(asked);
  return { period: "/dwell/time", most: `${field}/max`, exact: field, free: null, other: null }[
    choiceOf(asked)
  ];
}

/**
 * The request with another kind of time. The seconds are those of before; without them those of a
 * `cycleTime` that was given, or of the last answer.
 */
export function withTime(
  asked: ApiRequest,
  choice: Choice,
  cycleTime: number | null,
  last = 2,
): ApiRequest {
  const field = fieldOf(asked);
  const pointer = secondsAt(asked);
  const given = pointer === null ? last : Number(at(asked, pointer));
  const seconds = choice === "period" && cycleTime ? cycleTime : Math.ceil(given * 100) / 100;
  const free = put(put(asked, field, undefined), "/dwell", undefined);
  if (choice === "period")
    return put(free, "/dwell", { ...(isObject(asked.dwell) ? asked.dwell : {}), time: seconds });
  if (choice === "most") return put(free, field, { max: seconds });
  return choice === "exact" ? put(free, field, seconds) : free;
}

/** How long the motion may take, and how often it comes. */
export function TimeField() {
  const asked = request.value;
  const field = fieldOf(asked);
  const choice = choiceOf(asked);
  const seconds = secondsAt(asked);
  const options: Choice[] = [
    ...(["free", ...(kind.value === "cycle" ? [] : ["period"]), "most", "exact"] as Choice[]),
    ...(choice === "other" ? (["other"] as Choice[]) : []),
  ];
  const choose = (next: Choice) => {
    if (next === "other" || next === choice) return;
    const last = answered.value?.solution.duration;
    edit(withTime(asked, next, economics.value.cycleTime, last), typed.value);
  };
  return (
    <Section title="Time" action={choice === "period" ? null : <Every />}>
      <Segment
        label="Time"
        value={choice}
        onChange={choose}
        options={options.map((value) => ({ value, text: TEXTS[value] }))}
      />
      {seconds && (
        <div class="field">
          <span>
            {choice === "period"
              ? "from start to start"
              : kind.value === "cycle"
                ? "cycle time"
                : "duration"}
          </span>
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
    <span
      class="every"
      title="Adds the energy of the wait to the costs; the motion stays the same."
    >
      one {kind.value === "cycle" ? "cycle" : "move"} every{" "}
      <PlainNumber
        label="Time per move or cycle"
        unit="s"
        value={economics.value.cycleTime}
        least="above zero"
        empty="–"
        onValue={(cycleTime) => (economics.value = { ...economics.value, cycleTime })}
      />
    </span>
  );
}
