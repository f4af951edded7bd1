"""Inverse kinematics of every robot: is each configuration found again, how exact are the answers, how long they take.

    python -m benchmarks.inverse_kinematics --count 10000 --robots panda ur5e

Configurations are uniform over the joint ranges. Each must be among the solutions of its pose, or on one of the curves
that hold it. Every solution is replayed with Pinocchio, and no two may be the same. What is timed is a call
without full turns, as the search makes it, in seconds of the processor, so that other work does not count.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from joulepath.models.registry import load_robot, robot_names
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.ik_solutions import LimitedSolution
from joulepath.optimizer.kinematics.inverse import InverseKinematics, required_inverse_kinematics

# m and rad: what a solution may miss its pose by, and a configuration itself or its curve
ACCURACY, FOUND = 1e-9, 1e-6
# solutions that are closer are the same [rad]
SAME = 1e-7
# least share of configurations that are found, exact and single
REQUIRED = 0.999
# most time [s] of half the poses, by the number of joints
TIMES = {6: 1e-4, 7: 2e-3}
# misses that are printed per robot
SHOWN = 3


@dataclass(frozen=True)
class Outcome:
    """One pose: how far [rad] its configuration is from what was found, the greatest error [m, rad] of a solution, the
    least distance [rad] of two, and the problem of a refusal."""

    q: Array
    away: float = np.inf
    error: float = 0.0
    apart: float = np.inf
    refused: str = ""

    @property
    def good(self) -> bool:
        """Whether the configuration was found, and all solutions are exact and different."""
        return self.away < FOUND and self.error < ACCURACY and self.apart > SAME


def main() -> int:
    """Tries every robot and prints what was found."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=200, help="configurations per robot (%(default)s)")
    arguments.add_argument("--robots", nargs="+", default=list(robot_names()), help="(all)")
    given = arguments.parse_args()
    on_one_core()
    results = {name: _of_robot(load_robot(name), given.seed, given.count) for name in given.robots}
    write_json(given.json, {"seed": given.seed, "count": given.count, "robots": results})
    failed = [name for name, each in results.items() if each["share"] < REQUIRED]
    for name in failed:
        print(f"FAILED: {name}: {results[name]['share']:.2%} of the configurations, required {REQUIRED:.1%} or more")
    return 1 if failed else 0


def _of_robot(robot: Robot, seed: int, count: int) -> dict[str, Any]:
    rng, inverse = np.random.default_rng(seed), required_inverse_kinematics(robot, "goal")
    configurations = rng.uniform(robot.limits.q_min, robot.limits.q_max, (count, robot.nq))
    # before the poses are asked for again, and some are still known
    seconds = Spread.of(_seconds(inverse, [_flange(robot, q) for q in configurations]))
    outcomes = [_outcome(robot, inverse, q) for q in configurations]
    good = sum(each.good for each in outcomes)
    most = TIMES.get(robot.nq, np.inf)
    print(f"{robot.name:12s} {good} of {count} found, exact and single", flush=True)
    print(f"    {seconds.times(1e3).formatted(' ms', 3)}{'' if seconds.p50 <= most else f', wanted {1e3 * most:g} ms'}")
    for each in [each for each in outcomes if not each.good][:SHOWN]:
        print(f"    away {each.away:.1e}, error {each.error:.1e}, apart {each.apart:.1e} {each.refused}")
        print(f"        q = {each.q.tolist()}")
    return {
        "share": good / count,
        "error": max(each.error for each in outcomes),
        "seconds": seconds,
        "missed": [each.q for each in outcomes if not each.good],
    }


def _outcome(robot: Robot, inverse: InverseKinematics, q: Array) -> Outcome:
    T = _flange(robot, q)
    try:
        solutions = inverse.solve(T)
    except JoulepathError as error:
        return Outcome(q, refused=f"{error!r}")
    curves = {id(each.self_motion): each.self_motion for each in solutions if each.self_motion is not None}
    members = [curve.at(np.array([curve.parameter(q)]))[0] for curve in curves.values()]
    reached = [each.q for each in solutions] + members
    away = min(float(np.abs(wrapped(each - q)).max()) for each in reached)
    return Outcome(q, away, max(_error(robot, each, T) for each in reached), _apart(solutions))


def _seconds(inverse: InverseKinematics, poses: Sequence[Array]) -> list[float]:
    """Processor time [s] of each pose (4, 4)."""
    found = []
    for T in poses:
        began = time.thread_time()
        try:
            inverse.solve(T, windings=False)
        except JoulepathError:
            continue
        found.append(time.thread_time() - began)
    return found


def _apart(solutions: Sequence[LimitedSolution]) -> float:
    """The least distance [rad] of two solutions that are not members of one curve."""
    q = np.array([each.q for each in solutions])
    distance = np.abs(q[:, None] - q).max(axis=2)
    curve = np.array([id(each.self_motion) if each.self_motion is not None else k for k, each in enumerate(solutions)])
    distance[curve[:, None] == curve] = np.inf
    return float(distance.min(initial=np.inf))


def _error(robot: Robot, q: Array, T: Array) -> float:
    """The greater of distance [m] and angle [rad] between the flange at q (nq,) and T (4, 4), by Pinocchio."""
    reached = _flange(robot, q)
    turned = float(np.linalg.norm(reached[:3, :3] - T[:3, :3]) / np.sqrt(2))
    return max(float(np.linalg.norm(reached[:3, 3] - T[:3, 3])), turned)


def _flange(robot: Robot, q: Array) -> Array:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return np.asarray(data.oMf[robot.model.getFrameId("flange")].homogeneous)


if __name__ == "__main__":
    sys.exit(main())
