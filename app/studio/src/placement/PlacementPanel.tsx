import { Button } from "../ui/Button";
import { Icon } from "../ui/icons";
import { Note } from "../ui/Note";
import { ReportMenu } from "../ui/ReportMenu";
import { bestPose, close, COORDINATES, look, mapChanges, mapped, UNIT } from "../store/placement";
import { coordinatesOf, REASONS } from "../store/places";
import { plain } from "../store/facts";
import { reportPlaces } from "../store/report";
import { trying } from "../store/trouble";
import { figure, percent, shown, UNITS } from "../store/units";
import { MapTable } from "./MapTable";
import { PlaceLooked } from "./PlaceLooked";
import { RegionFields } from "./RegionFields";

/** Placement of the robot: the region, the best place found, and the selected place. */
export function PlacementPanel() {
  return (
    <aside class="answer" id="placement" aria-label="Placement of the robot" tabIndex={0}>
      <div class="panel-head">
        <h2>Placement of the robot</h2>
        <span class="space" />
        <Button kind="quiet" icon="close" label="Close" onClick={close} />
      </div>
      <PlaceLooked />
      <Found />
      <RegionFields />
      <MapTable />
    </aside>
  );
}

/** The best place of the region against that of now. */
function Found() {
  const map = mapped.value;
  if (!map) return null;
  const { best, nominal, nominal_reason, saving, tolerance, ...answer } = map.answer;
  const stale = mapChanges.value.length > 0;
  const joules = figure(best.energy);
  const { at, yaw } = coordinatesOf(bestPose(map), map.world);
  const values = { x: at[0], y: at[1], z: at[2], yaw };
  return (
    <section class={`hero${stale ? " stale" : ""}`} aria-label="Best place" id="best-place">
      {stale && (
        <p class="warning-text" id="map-stale">
          <Icon name="alert" /> This map does not include {mapChanges.value.length} of your changes:
          search again, or undo them.
        </p>
      )}
      <p class="hint">Best place found</p>
      <p class="big">
        {stale ? <s>{joules}</s> : joules} <small>J</small>
      </p>
      <dl class="facts">
        <div>
          <dt>current place</dt>
          <dd>
            {nominal
              ? `${figure(nominal.energy)} J`
              : nominal_reason
                ? REASONS[nominal_reason]
                : "–"}
          </dd>
        </div>
        <div>
          <dt>saving</dt>
          <dd id="place-saving">{saving === null ? "–" : percent(saving)}</dd>
        </div>
        <div>
          <dt>lower bound</dt>
          <dd>{answer.lower_bound === null ? "no bound" : `${figure(answer.lower_bound)} J`}</dd>
        </div>
        <div>
          <dt>places computed in all</dt>
          <dd>{answer.evaluated}</dd>
        </div>
      </dl>
      {answer.left_out > 0 && (
        <p class="warning-text">
          {answer.left_out} of the {map.places.length} places of the map were not computed within
          the search time: raise it, or the spacing of places.
        </p>
      )}
      {answer.warnings.map((text) => (
        <Note kind="warning" key={text}>
          {plain(text)}
        </Note>
      ))}
      <table id="tolerance">
        <thead>
          <tr>
            <td />
            <th scope="col">offset</th>
            <th scope="col">tolerance for 2 % more energy</th>
          </tr>
        </thead>
        <tbody>
          {COORDINATES.filter((name) => values[name] !== 0 || of(name)).map((name) => (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td>{withUnit(values[name], name)}</td>
              <td>
                {of(name)
                  ? `${withUnit(of(name)!.lower, name)} to +${withUnit(of(name)!.upper, name)}`
                  : "–"}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      <div class="row">
        <Button small disabled={stale} onClick={trying(() => look(bestPose(map)))} id="look-best">
          Select the best place
        </Button>
        {!stale && <ReportMenu write={reportPlaces} id="report-places" />}
      </div>
    </section>
  );

  function of(name: (typeof COORDINATES)[number]) {
    return tolerance.find(({ coordinate }) => coordinate === name);
  }
}

const withUnit = (value: number, name: (typeof COORDINATES)[number]) =>
  `${shown(value, UNIT[name])} ${UNITS[UNIT[name]].sign}`;
