"""Identification methods of the literature and `automatic` on the same logs, as a Markdown table.

    JOULEPATH_TEST_DATA=FOLDER python -m benchmarks.identification_methods

The real logs are from `benchmarks.identification_logs` and `benchmarks.public_logs`. There are no
public logs with a repeated motion, with a sensor beneath the base, or with joints that warm up, so
these logs are simulated. A cell has three errors [%] on held-out motions, which are from other days
or, for an arm with a single log, from this log: the mean error of torques over the joints, the
error of the energy at the shafts, and the error of the energy of a move if power was logged. A cell
is empty if the method refuses the logs.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.identification_logs import MISSING, folder, ur3e
from benchmarks.public_logs import panda_by_inria, ur10e_days
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import base_wrench_regressor, body_parameters
from joulepath.optimizer.exceptions import InvalidProblem, JoulepathError
from joulepath.optimizer.identify.choices import Method
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.problem.robots import load_robot
from tests.identification_logs import recorded, truth_of

METHODS: tuple[Method, ...] = get_args(Method)
REFIT = "automatic, links refitted"
WARMING = 20.0
"""Rise of the temperature of a joint over a simulated log [K]."""
FRICTION_DECREASE = 0.012
"""Relative decrease of friction with temperature [1/K]."""
SENSOR_NOISE = (0.5, 0.2)
"""Noise of a sensor beneath the base: standard deviations of forces [N] and moments [N·m]."""
MASS_FACTOR = 1.05
"""Link masses of a simulated arm over the link masses of the robot [1]."""
UNIT = 3
"""Seed of the simulated arm."""


@dataclass(frozen=True)
class Case:
    """Logs of one arm: the fitted logs, and further logs for validation, if any."""

    title: str
    robot: Robot
    logs: Sequence[Log]
    others: Sequence[Log] = ()
    options: IdentificationOptions = field(default_factory=IdentificationOptions)


@dataclass(frozen=True)
class Row:
    """Errors of a method [%], or the reason `why` it refuses the logs."""

    case: str
    method: str
    torque: float | None = None
    """Mean over the joints of the error relative to the measured torque."""
    shaft: float | None = None
    """Error of the energy at the shafts."""
    move: float | None = None
    """Mean error of the electrical energy of a move, if power was logged."""
    why: str = ""


def real_cases(place: Path) -> Iterator[Case]:
    """Logs of real arms."""
    ur10e, days = ur10e_days(place, ("20_02_10", "20_02_12"))
    first, second = days.values()
    yield Case("UR10e", ur10e, first, second)
    robot, log = ur3e(place)
    each = IdentificationOptions(held_out=1.0)
    yield Case("UR3e", robot, [log], options=each)
    panda = load_robot("panda")
    yield Case("Panda", panda, [panda_by_inria(place)])


def simulated_cases() -> Iterator[Case]:
    """Simulated logs, because no public logs of these kinds are known."""
    robot = load_robot("ur10e")
    truth = truth_of(robot, UNIT)
    other = recorded(robot, truth, moves=8, seed=31).log()
    repeated = recorded(robot, truth, moves=8, seed=UNIT, closed=True, cycles=4).log()
    period = float(np.diff(repeated.cycle_rows)[0]) / repeated.rate
    options = IdentificationOptions(period=period)
    yield Case("repeated", robot, [repeated], [other], options)
    yield Case("warming up", robot, [_warming(robot)], [other])
    heavier = _with_heavier_links(robot)
    other = recorded(heavier, truth, moves=8, seed=31).log()
    yield Case("on a sensor", robot, [_on_sensor(heavier)], [other])


def _warming(robot: Robot) -> Log:
    """A log in which all joints warm up; the mean friction is the friction of the other logs."""
    truth = truth_of(robot, UNIT)
    log = recorded(robot, truth, moves=16, seed=UNIT + 1).log()
    above = np.tile(np.linspace(-0.5, 0.5, len(log.time))[:, None] * WARMING, robot.nq)
    assert log.effort is not None
    speed = log.v / np.hypot(log.v, truth.knee)
    friction = truth.coulomb * speed + truth.viscous * log.v
    change = friction * np.expm1(-FRICTION_DECREASE * above) / truth.torque_constant
    return replace(log, effort=log.effort + change, temperature=30.0 + above)


def _with_heavier_links(robot: Robot) -> Robot:
    """The robot with heavier links."""
    mass = dict(robot.figures["inertials"]["mass"])
    mass["value"] = [MASS_FACTOR * each for each in mass["value"]]
    return load_robot(robot.name, figures={"robot": robot.name, "inertials": {"mass": mass}})


def _on_sensor(robot: Robot) -> Log:
    """A log with a force-torque sensor beneath the base."""
    log = recorded(robot, truth_of(robot, UNIT), moves=16, seed=UNIT + 2).log()
    wrench: Array = base_wrench_regressor(robot.model, log.q, log.v, log.a) @ body_parameters(
        robot.model
    )
    noise = np.random.default_rng(UNIT).normal(0.0, np.repeat(SENSOR_NOISE, 3), wrench.shape)
    return replace(log, wrench=wrench + noise)


def row_of(case: Case, name: str) -> Row:
    """Errors of a method on the logs of a case."""
    method: Any = "automatic" if name == REFIT else name
    options = replace(case.options, method=method, refit=True if name == REFIT else None)
    options = replace(options, held_out=0.0) if case.others else options
    try:
        found = identify(case.robot, case.logs, options, progress=False)
        errors = found.validate(case.others) if case.others else found.validation
    except (InvalidProblem, JoulepathError) as error:
        return Row(case.title, name, why=str(error))
    assert errors is not None
    torque, power = errors.fitted.torque, errors.fitted.power
    moving = () if torque is None else torque.relative[np.isfinite(torque.relative)]
    return Row(
        case.title,
        name,
        None if torque is None else float(np.mean(moving)),
        None if torque is None else torque.shaft_energy,
        None if power is None else power.energy_mean,
    )


def main() -> int:
    """Prints the table. Returns 0."""
    given, place = parser(__doc__).parse_args(), folder()
    on_one_core()
    if place is None:
        print(f"Real logs are left out. {MISSING}")
    cases = [*(real_cases(place) if place else ()), *simulated_cases()]
    names = (METHODS[0], REFIT, *METHODS[1:])
    rows = {name: [row_of(case, name) for case in cases] for name in names}
    print(
        f"| method | {' | '.join(case.title for case in cases)} |\n|{' --- |' * (len(cases) + 1)}"
    )
    for name, found in rows.items():
        print(f"| {name} | {' | '.join(map(_cell, found))} |")
    write_json(given.json, {"rows": [vars(row) for found in rows.values() for row in found]})
    return 0


def _cell(row: Row) -> str:
    """Errors [%] of torques, of the energy at the shafts, and of the energy of a move."""
    if row.why:
        return ""
    errors = (row.torque, row.shaft, row.move)
    return " / ".join("–" if each is None else f"{each:.2g}" for each in errors)


if __name__ == "__main__":
    sys.exit(main())
