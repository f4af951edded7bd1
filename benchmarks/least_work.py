"""Mechanical work of motions among obstacles, for the planning problems of a file.

    python -m benchmarks.least_work FILE
    python -m benchmarks.least_work FILE --count 3 --families cage --verbose

FILE has the format of `python -m benchmarks.foreign`. Every motion carries `--mass` and lasts
`--duration`, or slightly more than the fastest known motion if `--duration` is too short. The work
is the integral of the sum of |torque · speed| over the joints. The robot has neither rotors nor
friction, as in the metric of cuRobo. The motions are

- ours: from the start to the pose of the goal, in any posture
- free: the same without obstacles
- slowed: the fastest known motion to the joint positions of the goal, slowed down
- quintic: the straight line in joint space to the joint positions of the goal, with collisions

The means are over the problems for which all four motions exist.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.command import on_one_core, write_json
from benchmarks.foreign import ForeignProblem, Kind, problem_parser, selected
from benchmarks.statistics import Spread
from joulepath import optimize
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.motion.spline import Spline, lasting, sample
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.problem.scene import Scene
from joulepath.optimizer.search.errors import DurationTooShort

MOTIONS = ("ours", "free", "slowed", "quintic")
COM = [0.0, 0.0, 0.1]
"""Centre of mass of the payload in the flange frame [m]."""
SAMPLES = 4_001
"""Samples of a motion."""
DEADLINE = 30.0
"""Deadline of a request [s]."""
DURATION_FACTOR = 1.001
"""Duration of a motion over the shortest known duration, if the duration asked for is shorter
[1]."""


@dataclass(frozen=True)
class Works:
    """Works [J] of the motions of a problem; None without a motion."""

    name: str
    family: str
    duration: float
    ours: float | None = None
    free: float | None = None
    slowed: float | None = None
    quintic: float | None = None


def rigid(robot: Robot) -> Robot:
    """A robot with the same rigid bodies, without rotors and friction."""
    law, model = robot.friction, robot.model.copy()
    none, model.armature = np.zeros(robot.nq), np.zeros(model.nv)
    law = replace(law, coulomb=none, curved=none, viscous=none, load=None)
    drives = replace(robot.drives, rotor_inertia=none)
    return replace(robot, model=model, friction_laws={law.name: law}, drives=drives)


def work(arm: Arm, spline: Spline) -> float:
    """Work [J] of a motion of a rigid arm: the integral of Σ |torque · speed|."""
    load = arm.payload
    model = arm.robot.loaded_model(load.mass, load.com, load.inertia, arm.gravity)
    data, t = model.createData(), np.linspace(0.0, spline.duration, SAMPLES)
    q, v, a = sample(spline, t)
    tau = np.array([pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)])
    return float(np.trapezoid(np.abs(tau * v).sum(axis=1), t))


def motion(problem: Problem) -> Spline | None:
    """The motion of the answer to a problem; None without an answer."""
    try:
        return optimize(problem).trajectory.spline
    except JoulepathError:
        return None


def fastest(problem: Problem) -> Spline | None:
    """The motion with slightly more than the shortest known duration; None without a motion."""
    try:
        optimize(replace(problem, duration_min=None, duration_max=DURATIONS.least))
    except DurationTooShort as error:
        if error.shortest is None:
            return None
        least = DURATION_FACTOR * error.shortest
        return motion(replace(problem, duration_min=least, duration_max=least))
    except JoulepathError:
        return None
    raise AssertionError("a motion in no time")


def run(
    problem: ForeignProblem, robot: Robot, mass: float, duration: float, deadline: float
) -> Works:
    """The works of the motions of a problem for a rigid robot."""

    def asked(kind: Kind, duration: float) -> Problem:
        given = {"objective": "mechanical", "duration": duration}
        request = problem.requests[kind] | given | {"payload": {"mass": mass, "com": COM}}
        found = to_problem(OptimizeRequest.model_validate(request), deadline)
        return replace(found, arm=replace(found.arm, robot=robot))

    try:
        ours: Spline | None = optimize(asked("pose", duration)).trajectory.spline
    except DurationTooShort as error:
        duration = DURATION_FACTOR * (error.shortest or duration)
        ours = motion(asked("pose", duration))
    except JoulepathError:
        ours = None
    arm = asked("pose", duration).arm
    free = replace(asked("pose", duration), arm=replace(arm, scene=Scene()))
    found = {"ours": ours, "free": motion(free)}
    # the joint positions of the goal may be outside the limits
    with suppress(JoulepathError):
        to_joints = asked("joint", duration)
        assert isinstance(to_joints.start, np.ndarray) and isinstance(to_joints.goal, np.ndarray)
        found["quintic"] = quintic_spline(to_joints.start, to_joints.goal, duration)
        quick = fastest(to_joints)
        if quick is not None and quick.duration <= duration:
            found["slowed"] = lasting(quick, duration)
    works = {name: work(arm, each) for name, each in found.items() if each is not None}
    return Works(problem.name, problem.family, duration, **works)


def summary(outcomes: Sequence[Works]) -> dict[str, Any]:
    """Statistics by family; the family `all` contains all problems."""
    families = [*dict.fromkeys(each.family for each in outcomes), "all"]
    rows = [
        _row(family, [each for each in outcomes if family in (each.family, "all")])
        for family in families
    ]
    return {"rows": rows, "outcomes": [asdict(each) for each in outcomes]}


def _row(family: str, outcomes: Sequence[Works]) -> dict[str, Any]:
    found = np.array([[getattr(each, name) for name in MOTIONS] for each in outcomes], dtype=float)
    common = found[np.isfinite(found).all(axis=1)]
    ours, free = found[np.isfinite(found[:, :2]).all(axis=1), :2].T
    return {
        "family": family,
        "count": len(outcomes),
        "found": dict(zip(MOTIONS, np.isfinite(found).sum(axis=0).tolist(), strict=True)),
        "common": len(common),
        "mean": dict(zip(MOTIONS, map(_mean, common.T), strict=True)),
        "mean_of_ours": _mean(found[np.isfinite(found[:, 0]), 0]),
        "ratio_to_free": Spread.of((ours / free).tolist()),
    }


def _mean(values: Array) -> float:
    return float(values.mean()) if len(values) else np.nan


def print_summary(results: dict[str, Any]) -> None:
    """Prints the table."""
    print(f"{'family':20}{'':>8}" + "".join(f"{name:>9}" for name in MOTIONS) + "   ours / free")
    for row in results["rows"]:
        ratio = row["ratio_to_free"]
        print(
            f"{row['family']:20}{'found':>8}"
            + "".join(f"{row['found'][name]:9}" for name in MOTIONS)
            + f"   of {row['count']}\n{'':20}{'mean':>8}"
            + "".join(f"{row['mean'][name]:9.1f}" for name in MOTIONS)
            + f" J of {row['common']}; median {ratio.p50:.2f}, p90 {ratio.p90:.2f}; "
            f"ours {row['mean_of_ours']:.1f} J of all found"
        )


def main() -> int:
    """Runs the command; returns the exit code."""
    command = problem_parser(__doc__, "panda", DEADLINE)
    command.add_argument("--mass", type=float, default=2.9, help="payload [kg] (%(default)s)")
    command.add_argument(
        "--duration", type=float, default=1.362, help="duration of the motions [s] (%(default)s)"
    )
    given = command.parse_args()
    problems = selected(command, given)
    on_one_core()
    robot = rigid(load_robot(given.robot))
    compile_kernel(robot)
    outcomes: list[Works] = []
    for problem in problems:
        found = run(problem, robot, given.mass, given.duration, given.deadline)
        outcomes.append(found)
        if given.verbose:
            print(
                f"{found.name:24} {found.duration:6.3f} s"
                + "".join(f"{getattr(found, name) or np.nan:9.1f}" for name in MOTIONS),
                flush=True,
            )
    results = summary(outcomes)
    print_summary(results)
    write_json(given.json, results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
