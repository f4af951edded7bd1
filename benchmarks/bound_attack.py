"""Attacks on the proven lower bound: no motion from random starts may need less energy than it.

    python -m benchmarks.bound_attack --count 1000 --starts 20
    python -m benchmarks.bound_attack --robot panda --load 0.2 --bound tight

Every request is solved for its lower bound. Then motions with POINTS control points are optimised
from random initial guesses, between random configurations at the start and at the goal: any branch,
full turn, member of a self-motion and allowed orientation. The requests alternate between the kinds
of targets. Half of them have further conditions: payload, mounting, bus, dwell, a fixed duration,
the mechanical objective. With `--load`, friction grows with the torque in the gear of a joint.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.reference import perturbation
from benchmarks.statistics import Spread
from benchmarks.tasks import MOUNTS
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.problem.targets import AnyOf
from joulepath.optimizer.search.ends import label_of
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.solve_context import SolveContext

POINTS = 40
"""Control points of a motion of the attack."""
MEMBERS = 64
"""Number of samples of a self-motion, from which the attack draws."""
ORIENTATIONS = 64
"""Number of samples of the orientation of a partly free goal, from which the attack draws."""
NEAREST_SHARE = 0.4
"""Probability of the nearest goal configuration; the ranks have a geometric distribution [1]."""
DEADLINE = 60.0
"""Deadline of a request [s]."""
SOLVE_TIME = 20.0
"""Longest time of the solve from one initial guess [s]."""
ROUNDING = 1e-9
"""Relative rounding error of an energy and of a bound [1]."""


def _general(robot: Robot, rng: np.random.Generator) -> Array:
    return np.asarray(
        rng.uniform(np.maximum(robot.limits.q_min, -np.pi), np.minimum(robot.limits.q_max, np.pi))
    )


def _at(*joints: tuple[int, float]) -> Callable[[Robot, np.random.Generator], Array]:
    """Draws configurations with some joints at given angles [rad], or close to them."""

    def draw(robot: Robot, rng: np.random.Generator) -> Array:
        q = _general(robot, rng)
        offset = 0.0 if rng.random() < 0.5 else 10 ** rng.uniform(-9, -2)
        for joint, angle in joints:
            q[joint] = angle + offset
        return q

    return draw


CONFIGURATIONS: dict[str, Callable[[Robot, np.random.Generator], Array]] = {
    "general": _general,
    "wrist": _at((4, 0.0)),
    "folded wrist": _at((4, np.pi)),
    "elbow": _at((2, 0.0)),
    "elbow and wrist": _at((2, 0.0), (4, 0.0)),
    "upright": _at((1, -np.pi / 2), (2, 0.0), (3, -np.pi / 2), (4, 0.0)),
}
TARGETS = ("pose", "start and goal", "free about", "cone", "free", "several")


def request(robot: Robot, seed: int, index: int, **fixed: Any) -> tuple[str, Problem]:
    """Kind and problem of request `index` of a seed; `fixed` are fields of all problems."""
    rng = np.random.default_rng([seed, index])
    place = list(CONFIGURATIONS)[index % len(CONFIGURATIONS)]
    target = TARGETS[index // len(CONFIGURATIONS) % len(TARGETS)]
    arm, fields = (
        _conditions(robot, rng) if rng.random() < 0.5 else (Arm(robot=robot, collisions=False), {})
    )
    start = _general(robot, rng)
    q_goal = CONFIGURATIONS[place](robot, rng)
    T = tcp_pose(arm, q_goal)
    axis = np.array([0.0, 0.0, 1.0])
    targets: dict[str, Any] = {
        "pose": Pose(T),
        "start and goal": Pose(T),
        "free about": ConeOrientedPose.about(Pose(T), axis),
        "cone": ConeOrientedPose(T[:3, 3], axis, T[:3, :3] @ axis, float(rng.uniform(0.1, 1.0))),
        "free": ConeOrientedPose(T[:3, 3], axis, T[:3, :3] @ axis, np.pi),
        "several": AnyOf((Pose(T), Pose(tcp_pose(arm, _general(robot, rng))))),
    }
    begin: Any = (
        Pose(tcp_pose(arm, CONFIGURATIONS[place](robot, rng)))
        if target == "start and goal"
        else start
    )
    return f"{target}, {place}", Problem(
        arm=arm, start=begin, goal=targets[target], deadline=DEADLINE, **fields, **fixed
    )


def _conditions(robot: Robot, rng: np.random.Generator) -> tuple[Arm, dict[str, Any]]:
    """An arm with random payload, mounting and bus, and random fields of the problem."""
    mass = float(rng.uniform(0.0, robot.rated_payload))
    com = rng.uniform([-0.05, -0.05, 0.0], [0.05, 0.05, 0.1])
    buses = [
        Bus(),
        Bus(mode="isolated"),
        Bus(mode="recuperating", efficiency=float(rng.uniform(0.3, 1.0))),
    ]
    arm = Arm(
        robot=robot,
        collisions=False,
        payload=Payload(mass=mass, com=com),
        gravity=np.array(MOUNTS[str(rng.choice(list(MOUNTS)))]),
        bus=buses[int(rng.integers(len(buses)))],
    )
    fields: dict[str, Any] = {}
    kind = rng.integers(4)
    if kind == 0:
        fields = {"objective": "mechanical", "duration_max": float(rng.uniform(2.0, 5.0))}
    elif kind == 1:
        duration = float(rng.uniform(1.5, 5.0))
        fields = {"duration_min": duration, "duration_max": duration}
    elif kind == 2:
        fields = {"dwell": Dwell(time=float(rng.uniform(4.0, 8.0)), hold="motors")}
    return arm, fields


def configurations(problem: Problem, target: Any, rng: np.random.Generator) -> Array:
    """Configurations (n, nq) [rad] at a target: all branches and full turns, and samples of
    self-motions.
    """
    if isinstance(target, np.ndarray):
        return target[None]
    if isinstance(target, AnyOf):
        target = target.targets[int(rng.integers(len(target.targets)))]
    if isinstance(target, ConeOrientedPose):
        R = sample_orientations(target, ORIENTATIONS)
        target = target.with_orientation(R[int(rng.integers(len(R)))])
    arm = problem.arm
    kinematics = required_inverse_kinematics(arm.robot, "goal")
    try:
        found = kinematics.solve(target.T, arm.T_flange_tcp, arm.active_limits, members=MEMBERS)
    except JoulepathError:
        return np.zeros((0, arm.robot.nq))
    return np.array([each.q for each in found])


def attack(problem: Problem, starts: int, rng: np.random.Generator) -> tuple[float, str]:
    """The least energy [J] of motions from random starts, and the label of its goal
    configuration."""
    prepared, least, label = PreparedProblem.of(problem), np.inf, ""
    arm, space = problem.arm, bspline.uniform(POINTS)
    for _ in range(starts):
        starts_q, goals_q = (
            configurations(problem, target, rng) for target in (problem.start, problem.goal)
        )
        if not len(starts_q) or not len(goals_q):
            continue
        q_start = starts_q[int(rng.integers(len(starts_q)))]
        q_goal = _near(goals_q, q_start, arm.friction_law.coulomb, rng)
        points = q_start + np.outer(space.quintic, q_goal - q_start)
        if rng.random() < 0.7:
            points[space.free] += perturbation(rng, space, len(q_start))
        limits = arm.active_limits
        guess = Guess(
            space, np.clip(points, limits.q_min, limits.q_max), problem.duration_min or 0.0
        )
        direct = replace(problem, start=q_start, goal=q_goal)
        context = SolveContext.of(
            replace(prepared, problem=direct), q_start, q_goal, Deadline.after(SOLVE_TIME)
        )
        spline = FreeSpline(context).improve(guess).spline
        if spline is None:
            continue
        energy = prepared.objective_of(prepared.energy(spline))
        if energy < least:
            least, label = energy, label_of(arm.robot, q_goal)
    return least, label


def _near(choices: Array, q: Array, coulomb: Array, rng: np.random.Generator) -> Array:
    """A random one of the configurations (n, nq), preferably with little friction on the way to
    it."""
    order = np.argsort(np.abs(choices - q) @ coulomb)
    return np.asarray(choices[order[min(int(rng.geometric(NEAREST_SHARE)) - 1, len(order) - 1)]])


def _loaded(robot: Robot, share: float) -> Robot:
    """The robot with friction that is a share of the load of a joint; unchanged if it is zero."""
    if not share:
        return robot
    load = np.full(robot.nq, share)
    return replace(
        robot, friction_laws={n: replace(law, load=load) for n, law in robot.friction_laws.items()}
    )


def main() -> int:
    """Prints every broken bound, and the excess of the answers over the attack; returns 1 if a
    bound is broken."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=60, help="requests (%(default)s)")
    arguments.add_argument(
        "--starts", type=int, default=20, help="motions per request (%(default)s)"
    )
    arguments.add_argument("--robot", default="ur5e", help="robot (%(default)s)")
    arguments.add_argument(
        "--load", type=float, default=0.0, help="friction over the load of a joint (%(default)s)"
    )
    arguments.add_argument(
        "--bound", choices=("normal", "tight"), default="normal", help="bound (%(default)s)"
    )
    given = arguments.parse_args()
    on_one_core()
    robot = _loaded(load_robot(given.robot), given.load)
    compile_kernel(robot)
    rows: list[dict[str, Any]] = []
    refused, broken = 0, list[str]()
    for index in range(given.count):
        kind, problem = request(robot, given.seed, index, bound=given.bound)
        try:
            solution = optimize(problem)
        except JoulepathError as error:
            refused += 1
            print(f"index {index} ({kind}): {type(error).__name__}")
            continue
        energy = solution.energy.of(problem.objective)
        rng = np.random.default_rng([given.seed, index, 1])
        least, label = attack(problem, given.starts, rng)
        row = {
            "index": index,
            "kind": kind,
            "energy": energy,
            "bound": solution.lower_bound,
            "attack": least,
        }
        rows.append(row | {"status": solution.status})
        summary = f"index {index} ({kind}, {solution.status}): {energy:.4f} J, attack {least:.4f} J"
        print(f"{summary}, bound {solution.lower_bound:.4f} J", flush=True)
        if min(least, energy) < solution.lower_bound - ROUNDING * abs(energy):
            broken.append(f"{summary} to {label}, bound {solution.lower_bound:.9f} J")
            print("BROKEN", broken[-1])
    excess = [
        row["energy"] / row["attack"] - 1
        for row in rows
        if np.isfinite(row["attack"]) and row["attack"] > 0
    ]
    print(
        f"requests                 {len(rows)} solved, {refused} refused; {given.starts} starts "
        "each"
    )
    print(f"bounds broken            {len(broken)}")
    print(f"answer above the attack  {Spread.of(excess).times(100).formatted(' %', 2)}")
    write_json(
        given.json, {"seed": given.seed, "starts": given.starts, "rows": rows, "broken": broken}
    )
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
