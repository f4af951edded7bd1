import { NumberCell } from "../ui/NumberCell";
import { Segment } from "../ui/Segment";
import { gripped } from "../store/load";
import { at, put, type Pointer } from "../store/pointer";
import { isObject } from "../store/request";
import { edit, request } from "../store/state";
import type { Stop } from "../store/types";
import { OverRating } from "./OverRating";
import { PayloadFields } from "./PayloadFields";

type Deed = "same" | "takes" | "puts" | "passes";

const DEEDS = [
  { value: "same", text: "rests" },
  { value: "takes", text: "picks up" },
  { value: "puts", text: "puts down" },
  { value: "passes", text: "passes" },
] as const;

function deedOf(stop: Stop): Deed {
  if (stop.via) return "passes";
  if (!("payload" in stop)) return "same";
  return stop.payload ? "takes" : "puts";
}

function withDeed(stop: Stop, deed: Deed): Stop {
  const { payload: _, via: __, ...rest } = stop;
  if (deed === "same") return rest;
  if (deed === "puts") return { ...rest, payload: null };
  if (deed === "takes") return { ...rest, payload: { mass: 1, com: gripped(request.value) } };
  const { dwell: ___, approach: ____, retreat: _____, ...passing } = rest;
  return { ...passing, via: true };
}

/** What the arm does at a stop, in a few words. */
export function deedText(stop: unknown): string {
  if (!isObject(stop)) return "";
  const deed = deedOf(stop as Stop);
  if (deed === "takes") return `picks up ${(stop as Stop).payload?.mass ?? "?"} kg`;
  return deed === "puts" ? "puts down" : deed === "passes" ? "passes" : "";
}

/** What the arm does at a stop. */
export function StopFields({ pointer }: { pointer: Pointer }) {
  const stop = at(request.value, pointer);
  if (!isObject(stop)) return null;
  const deed = deedOf(stop as Stop);
  const line = (field: "approach" | "retreat") => {
    const given = isObject(stop[field]);
    const set = (on: boolean) =>
      edit(
        put(
          request.value,
          `${pointer}/${field}`,
          on ? { direction: [0, 0, field === "approach" ? 1 : -1], distance: 0.05 } : undefined,
        ),
      );
    return (
      <label class="field">
        <input
          type="checkbox"
          checked={given}
          onChange={(event) => set(event.currentTarget.checked)}
        />
        <span>straight {field} along the tool</span>
        {given && (
          <NumberCell
            label={field}
            pointer={`${pointer}/${field}/distance`}
            value={at(request.value, `${pointer}/${field}/distance`)}
            unit="mm"
            withUnit
          />
        )}
      </label>
    );
  };
  return (
    <div class="stop-fields">
      <Segment
        label="Here the arm"
        options={DEEDS}
        value={deed}
        onChange={(next) => edit(put(request.value, pointer, withDeed(stop as Stop, next)))}
      />
      {deed === "takes" && (
        <>
          <div class="field">
            <span>mass</span>
            <NumberCell
              label="Payload mass"
              pointer={`${pointer}/payload/mass`}
              value={at(request.value, `${pointer}/payload/mass`)}
              unit="kg"
              withUnit
            />
          </div>
          <OverRating mass={at(request.value, `${pointer}/payload/mass`)} />
          <PayloadFields pointer={`${pointer}/payload`} />
        </>
      )}
      {deed !== "passes" && (
        <>
          <div class="field">
            <span>dwell</span>
            <NumberCell
              label="Dwell"
              pointer={`${pointer}/dwell`}
              value={stop.dwell ?? 0}
              unit="s"
              withUnit
            />
          </div>
          {line("approach")}
          {line("retreat")}
        </>
      )}
    </div>
  );
}
