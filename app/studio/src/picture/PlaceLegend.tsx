import { layer, mapShown } from "../store/placement";
import { columnsOf, energiesOf, LEFT_OUT, REASONS, type Reason } from "../store/places";
import { figure } from "../store/units";
import { rampStops } from "./path";

const SIGNS: Record<Reason | "none", string> = {
  reach: "×",
  collision: "□",
  torque: "▽",
  time: "△",
  motion: "+",
  none: "·",
};

/** What the colours and marks of the map mean. */
export function PlaceLegend() {
  const map = mapShown.value;
  if (!map) return null;
  const columns = columnsOf(map.places, layer.value);
  const energies = energiesOf(columns);
  const failed = new Set<Reason | "none">(
    columns.flatMap(({ energy, reason }) => (energy === null ? [reason ?? "none"] : [])),
  );
  return (
    <div class="legend" id="place-legend">
      Energy at each place of the base
      {energies && (
        <>
          <i style={{ background: `linear-gradient(90deg, ${rampStops.join(", ")})` }} />
          <div>
            <span>{figure(energies[0])} J</span>
            <span>{figure(energies[1])} J</span>
          </div>
        </>
      )}
      <ul>
        {[...failed].map((reason) => (
          <li key={reason}>
            <b>{SIGNS[reason]}</b> {reason === "none" ? LEFT_OUT : REASONS[reason]}
          </li>
        ))}
      </ul>
    </div>
  );
}
