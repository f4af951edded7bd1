"""The sharing of time on cells of others: robots in a cycle time, where a move's energy is a function of its duration.

    python -m benchmarks.time_sharing FILE

FILE is XML in the format of https://github.com/CTU-IIG/GeneratorOfRoboticCells. Its `datasets/` hold a welding cell of
six robots by measured figures: `SkodaRoboticCell-MotorsOnly.xml`, and `SkodaRoboticCell-PowerSavingModes.xml` where a
robot may wait on its brakes, too (Bukata, Sucha, Hanzalek and Burget, Energy Optimization of Robotic Cells, IEEE
Transactions on Industrial Informatics 13, 2017).

Every robot has the cycle time for itself: that they wait for each other is left out. Its moves share the time by the
rules of `POST /cycle`, and it waits at the last stop of its cycle, in the mode that needs the least. Beside this stand
all moves at full speed with the rest waited out on the motors, and the optimum by a solver of another kind: SLSQP on
all durations at once. The exit code is 1 if the shared time needs more than the optimum by 0.01 %.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import LinearConstraint, brentq, minimize

from benchmarks.command import parser, write_json
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.time_sharing import TimeSharing, energy_of

# the mode in which a robot waits on its motors
MOTORS = "0"
# of the shared time above the optimum, relative
TOLERANCE = 1e-4


@dataclass(frozen=True)
class Movement:
    """A move whose energy [J] is Σ coefficient · duration^degree, between its shortest and longest duration [s]."""

    terms: tuple[tuple[int, float], ...]
    shortest: float
    longest: float
    duration: float

    @property
    def energy(self) -> float:
        """Its energy [J]."""
        return sum(factor * self.duration**degree for degree, factor in self.terms)

    def slope(self, duration: float) -> float:
        """What one more second adds to its energy [W]."""
        return sum(factor * degree * duration ** (degree - 1) for degree, factor in self.terms)

    def at(self, price: float) -> Movement:
        """The move in the duration of least energy + price · duration."""
        if self.slope(self.shortest) + price >= 0:
            return replace(self, duration=self.shortest)
        if self.slope(self.longest) + price <= 0:
            return replace(self, duration=self.longest)
        best = brentq(lambda duration: self.slope(duration) + price, self.shortest, self.longest)
        return replace(self, duration=float(best))


@dataclass(frozen=True)
class Wait:
    """A way to wait: the power [W] that it draws, and how long it lasts at least [s]."""

    power: float
    shortest: float


@dataclass(frozen=True)
class Robot:
    """A robot of a cell: its moves, duration [s] and energy [J] of its stops, and its ways to wait, on motors first."""

    name: str
    moves: tuple[Movement, ...]
    stopped: float
    stops: float
    waits: tuple[Wait, ...]

    def energy(self, lengths: Sequence[float], wait: Wait, cycle: float) -> float:
        """Energy [J] of a cycle [s] with moves of these durations [s]."""
        moves = [replace(move, duration=length) for move, length in zip(self.moves, lengths, strict=True)]
        return energy_of(moves) + self.stops + wait.power * (cycle - self.stopped - sum(lengths))


def read(file: Path) -> tuple[float, list[Robot]]:
    """The cycle time [s] and the robots of a cell."""
    root = ElementTree.parse(file).getroot()
    return _number(root, ".//production-cycle-time"), [_robot(each) for each in root.iter("robot")]


def _number(element: ElementTree.Element, path: str) -> float:
    return float(element.findtext(path, default="nan"))


def _robot(element: ElementTree.Element) -> Robot:
    name = element.findtext("name", default="?")
    modes = {each.get("pid", ""): each for each in element.iter("power-mode")}
    usual = {mode: _number(each, "expected-input-power") for mode, each in modes.items()}
    stopped = stops = 0.0
    waits = tuple[Wait, ...]()
    for stop in element.iter("static-activity"):
        if len(stop.findall(".//location")) != 1:
            raise SystemExit(f"{name}: a stop with several locations is not for this benchmark")
        own = {each.get("pid"): float(each.get("input_power", "nan")) for each in stop.iter("consumption")}
        power = {mode: own.get(mode, drawn) for mode, drawn in usual.items()}
        shortest = _number(stop, "min-duration")
        stopped, stops = stopped + shortest, stops + shortest * power[MOTORS]
        if stop.get("last_in_cycle") == "true":
            waits = tuple(Wait(power[mode], _number(modes[mode], "minimal-idle-time")) for mode in sorted(modes))
    return Robot(name, tuple(_movement(each) for each in element.iter("movement")), stopped, stops, waits)


def _movement(element: ElementTree.Element) -> Movement:
    terms = tuple((int(each.get("degree", "0")), float(each.get("coeff", "nan"))) for each in element.iter("monomial"))
    shortest = _number(element, "min-duration")
    return Movement(terms, shortest, _number(element, "max-duration"), shortest)


def at_full_speed(robot: Robot, wait: Wait, cycle: float) -> float:
    """Energy [J] of a cycle [s] with all moves as fast as they can be."""
    return robot.energy([move.shortest for move in robot.moves], wait, cycle)


def shared(robot: Robot, wait: Wait, cycle: float) -> float:
    """Energy [J] of a cycle [s] whose time is shared as that of a round."""
    time = cycle - robot.stopped
    found = TimeSharing(robot.moves).fill(time, wait.power, robot.moves)
    if found.waited < wait.shortest:
        found = TimeSharing(robot.moves).fill(time - wait.shortest, wait.power, robot.moves)
    return robot.energy(found.lengths, wait, cycle)


def optimum(robot: Robot, wait: Wait, cycle: float) -> float:
    """Least energy [J] of a cycle [s], by a solver of another kind."""
    time = cycle - robot.stopped - wait.shortest

    def drawn(lengths: Array) -> float:
        return robot.energy(lengths.tolist(), wait, cycle)

    def slopes(lengths: Array) -> Array:
        pairs = zip(robot.moves, lengths.tolist(), strict=True)
        return np.array([move.slope(length) - wait.power for move, length in pairs])

    found = minimize(
        drawn,
        np.array([move.shortest for move in robot.moves]),
        jac=slopes,
        bounds=[(move.shortest, move.longest) for move in robot.moves],
        constraints=LinearConstraint(np.ones((1, len(robot.moves))), -np.inf, time),
        method="SLSQP",
        tol=1e-9,
    )
    return float(found.fun)


def energies(robot: Robot, cycle: float) -> dict[str, float]:
    """Energies [J] of a cycle [s] of a robot, by the ways to share its time."""
    fastest = sum(move.shortest for move in robot.moves)
    waits = [wait for wait in robot.waits if fastest + wait.shortest <= cycle - robot.stopped]
    return {
        "full speed": at_full_speed(robot, robot.waits[0], cycle),
        "shared": min(shared(robot, wait, cycle) for wait in waits),
        "optimum": min(optimum(robot, wait, cycle) for wait in waits),
    }


def main() -> None:
    """Shares the time of every robot of a cell, and prints its energy beside the optimum and beside full speed."""
    arguments = parser(__doc__)
    arguments.add_argument("file", type=Path, help="a cell, XML")
    given = arguments.parse_args()
    cycle, cell = read(given.file)
    found = {robot.name: energies(robot, cycle) for robot in cell}
    found["cell"] = {way: sum(each[way] for each in found.values()) for way in found[cell[0].name]}
    print(f"cycle of {cycle} s; energies [kJ]")
    print(f"{'':10s} {'full speed':>10s} {'shared':>10s} {'saved':>7s} {'optimum':>10s} {'above it':>9s}")
    for name, each in found.items():
        full, ours, best = (each[way] / 1e3 for way in ("full speed", "shared", "optimum"))
        print(f"{name:10s} {full:10.2f} {ours:10.2f} {1 - ours / full:7.1%} {best:10.2f} {ours / best - 1:9.1e}")
    write_json(given.json, {"cycle": cycle, "energies": found})
    if any(each["shared"] > each["optimum"] * (1 + TOLERANCE) for each in found.values()):
        raise SystemExit("a time is not shared best")


if __name__ == "__main__":
    main()
