import { Errors } from "../ui/Errors";
import { NumberCell } from "../ui/NumberCell";
import { Section } from "../ui/Section";
import { Segment } from "../ui/Segment";
import { at, put } from "../store/pointer";
import { edit, request, write } from "../store/state";

const SHAPES = [
  { value: "lines", text: "Lines" },
  { value: "curve", text: "Curve" },
  { value: "arc", text: "Arc" },
] as const;

/** How the TCP goes along the path. */
export function PathFields() {
  const shape = String(
    at(request.value, "/path/shape") ?? "lines",
  ) as (typeof SHAPES)[number]["value"];
  const speed = at(request.value, "/path/speed");
  return (
    <Section title="Along the path">
      <Segment
        label="Shape of the path"
        options={SHAPES}
        value={shape}
        onChange={(next) => edit(put(request.value, "/path/shape", next))}
      />
      <div class="fields">
        <label class="field">
          <span>TCP speed</span>
          <input
            type="checkbox"
            aria-label="Limit the speed"
            checked={speed !== undefined && speed !== null}
            onChange={(event) =>
              write("/path/speed", event.currentTarget.checked ? 0.1 : undefined)
            }
          />
          {typeof speed === "number" ? (
            <NumberCell
              label="TCP speed"
              pointer="/path/speed"
              value={speed}
              unit="mmps"
              withUnit
            />
          ) : (
            <small>as fast as the limits allow</small>
          )}
        </label>
        {shape === "lines" && (
          <div class="field">
            <span>Corners rounded by</span>
            <NumberCell
              label="Blend"
              pointer="/path/blend"
              value={at(request.value, "/path/blend") ?? 0}
              unit="mm"
              withUnit
            />
          </div>
        )}
      </div>
      <Errors under="/path" except={["/path/via"]} />
    </Section>
  );
}
