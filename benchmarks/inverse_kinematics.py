"""Inverse kinematics of six joints: poses of random arms that are refused, and the time of a pose.

    python -m benchmarks.inverse_kinematics --patterns
    python -m benchmarks.inverse_kinematics --count 2000

The arms of `--patterns` have axes in every pattern of parallel, meeting, square and oblique
neighbours, in any sense and with any zero position. Every pose is made by forward kinematics, at
random joint positions or, for one pose in four, at quarter turns, so that a configuration exists.
The command counts the poses that are refused as out of reach or not found, and the answers whose
forward kinematics is not the pose. The exit code is 1 if there are any. Without the option, it
measures the time of one pose for arms of every form.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from itertools import product
from typing import Any

import numpy as np

from benchmarks.command import on_one_core, parser, verdict, write_json
from benchmarks.statistics import Spread
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import NoConfigurationFound, SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.inverse import (
    inverse_kinematics_for,
    required_inverse_kinematics,
)
from tests.optimizer.kinematics.axis_patterns import (
    RELATIONS,
    UR_AXES,
    Relation,
    is_degenerate,
    random_axes,
    redrawn,
    robot_of,
)

PATTERNS: list[tuple[Relation, ...]] = list(product(RELATIONS, repeat=5))
ACCURACY = 1e-9  # largest pose error of an answer [m, 1]
FOUND = 1e-6  # largest joint distance of a configuration found again [rad]
QUARTERS = 4  # one pose in so many has all joints at quarter turns


def outcome(robot: Robot, q: Array) -> str:
    """What inverse kinematics makes of the pose at q (6,) [rad]."""
    T = Chain.of(robot.model).flange(q[None])[0]
    # a cache full of random arms would hold no other
    kinematics = inverse_kinematics_for.__wrapped__(robot)
    assert kinematics is not None
    try:
        branches = kinematics.solve(T, windings=False)
    except (UnreachablePose, NoConfigurationFound, SingularPose) as error:
        return type(error).__name__
    found = np.array([each.q for each in branches])
    if np.abs(Chain.of(robot.model).flange(found) - T).max() > ACCURACY:
        return "wrong pose"
    is_known = np.abs(wrapped(found - q)).max(axis=1).min() < FOUND
    is_free = any(each.self_motion is not None for each in branches)
    if is_known or is_free:
        return "found"
    return "another branch, complete" if kinematics.complete else "another branch"


WRONG = ("UnreachablePose", "NoConfigurationFound", "wrong pose", "another branch, complete")


def of_patterns(seed: int, count: int) -> dict[str, Any]:
    """Outcomes of poses of random arms, one pose of each, and the wrong ones."""
    rng = np.random.default_rng(seed)
    outcomes: dict[str, Counter[str]] = {"random": Counter(), "quarter turns": Counter()}
    wrong, number = list[str](), 0
    while number < count:
        pattern = PATTERNS[rng.integers(len(PATTERNS))]
        axes = random_axes(pattern, rng)
        if is_degenerate(axes, rng):
            continue
        at_quarters = number % QUARTERS == QUARTERS - 1
        robot = robot_of(axes if at_quarters else redrawn(axes, rng)[0])
        q = rng.integers(-2, 3, 6) * (np.pi / 2) if at_quarters else rng.uniform(-np.pi, np.pi, 6)
        found = outcome(robot, np.asarray(q))
        outcomes["quarter turns" if at_quarters else "random"][found] += 1
        if found in WRONG:
            wrong.append(f"{number}: {', '.join(pattern)}: {found} at {q.round(4).tolist()}")
        number += 1
    return {"outcomes": {name: dict(each) for name, each in outcomes.items()}, "wrong": wrong}


def forms(rng: np.random.Generator) -> dict[str, Robot]:
    """An arm of every form of six joints."""
    other = redrawn(UR_AXES, rng)[0]
    inner: tuple[Relation, ...] = ("opposed", "square", "parallel", "parallel", "square")
    general: tuple[Relation, ...] = ("square", "oblique", "square", "oblique", "square")
    return {
        "Universal Robots' form": load_robot("ur5e"),
        "the same, redrawn": robot_of(other),
        "spherical wrist": load_robot("kr10_r1100"),
        "another trio": robot_of(random_axes(inner, rng)),
        "no trio": robot_of(random_axes(general, rng)),
    }


def times(seed: int, count: int) -> dict[str, Spread]:
    """Time [s] of one pose, without full turns, for an arm of every form."""
    rng, found = np.random.default_rng(seed), dict[str, Spread]()
    for name, robot in forms(rng).items():
        kinematics = required_inverse_kinematics(robot, "goal")
        q = rng.uniform(-np.pi, np.pi, (count + 1, 6))
        walls = []
        for T in Chain.of(robot.model).flange(q):
            began = time.perf_counter()
            kinematics.branches(T)
            walls.append(time.perf_counter() - began)
        found[name] = Spread.of(walls[1:])
    return found


def main() -> int:
    """Counts refused poses, or measures times."""
    arguments = parser(__doc__, seed=51)
    arguments.add_argument("--patterns", action="store_true", help="count refused poses")
    arguments.add_argument("--count", type=int, help="poses (10,000 of patterns, 500 of each form)")
    given = arguments.parse_args()
    on_one_core()
    if not given.patterns:
        measured = times(given.seed, given.count or 500)
        for name, each in measured.items():
            print(f"{name:24s} {each.times(1e3).formatted(' ms', 3)}")
        write_json(given.json, measured)
        return 0
    results = of_patterns(given.seed, given.count or 10_000)
    for name, counted in results["outcomes"].items():
        print(f"{name}: " + ", ".join(f"{count} {each}" for each, count in counted.items()))
    return verdict(given.json, results, results["wrong"])


if __name__ == "__main__":
    sys.exit(main())
