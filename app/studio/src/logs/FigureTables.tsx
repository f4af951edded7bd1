import { Table } from "../ui/Table";
import type { Parameter, Robot } from "../store/types";
import { figure, jointName, percent, words } from "../store/units";
import type { Found, Validation } from "./model";

const UNITS: Record<string, string> = { offset: "N·m", payload_mass: "kg", link_mass_scale: "1" }; // of what no document has
const POWER: Record<string, [string, string]> = {
  rmse: ["power, root mean square", "W"],
  energy_mean: ["energy of a move, mean", "%"],
  energy_p90: ["energy of a move, 90th percentile", "%"],
  energy_max: ["energy of a move, maximum", "%"],
};

/**
 * Errors on moves that no fit has seen: of these figures, of the robot's own, and of a constant
 * power.
 */
export function ErrorTable({ validation, robot }: { validation: Validation; robot: Robot }) {
  const { moves, fitted, own, constant, coverage, half_width } = validation;
  const torque = fitted.torque
    ? [
        ...robot.joints.map((name, j) => [
          `torque, ${jointName(name)}`,
          fitted.torque!.relative[j]!,
          own.torque.relative[j]!,
          "",
          "%",
        ]),
        ["shaft energy", fitted.torque.shaft_energy, own.torque.shaft_energy, "", "%"],
        ["copper loss", fitted.torque.copper_energy, own.torque.copper_energy, "", "%"],
      ]
    : [];
  const power = fitted.power
    ? (Object.keys(POWER) as (keyof typeof constant)[]).map((key) => [
        POWER[key]![0],
        fitted.power![key],
        own.power[key],
        constant[key],
        POWER[key]![1],
      ])
    : [];
  return (
    <article>
      <h3>
        Errors <small>on {moves} moves held out from the fit</small>
      </h3>
      <Table
        label="Errors"
        head={["", "these figures", "robot's own", "constant", ""]}
        rows={[...torque, ...power].map((cells) => ({ cells }))}
      />
      {coverage !== null && (
        <p class="hint">
          {percent(coverage)} of the energies lie within their 90 % intervals, which extend{" "}
          {figure(half_width, 2)} % to both sides of the prediction.
        </p>
      )}
    </article>
  );
}

/**
 * All figures that were sought, with what the robot's own documents say of those that the logs did
 * not tell.
 */
export function FigureTable({
  result: { parameters, document: found },
  robot,
}: {
  result: Found;
  robot: Robot;
}) {
  const own = [robot.drives, robot.electronics, robot.friction.laws[0]?.coefficients];
  const these = [found.drives, found.electronics, found.friction_laws?.identified];
  const of = (places: (Record<string, Parameter> | undefined)[], name: string) =>
    places.find((place) => place?.[name])?.[name];
  const rows = parameters.map(({ figure: name, joint, value, sd, previous, identified, why }) => ({
    title: why ?? undefined,
    cells: [
      <span>
        {words(name)}
        {why && <small> {why}</small>}
      </span>,
      joint === null ? "" : jointName(robot.joints[joint]!),
      value,
      identified ? sd : null,
      previous,
      of(identified ? these : own, name)?.trust ?? "–",
      (of(these, name) ?? of(own, name))?.unit ?? UNITS[name] ?? "",
    ],
  }));
  return (
    <article class="wide">
      <h3>
        Figures{" "}
        <small>
          trust: A manufacturer, B fitted to measured data, C second-hand, T sister robot, E default
        </small>
      </h3>
      <Table
        label="Figures"
        head={["figure", "joint", "value", "standard deviation", "robot's own", "trust", "unit"]}
        rows={rows}
      />
    </article>
  );
}
