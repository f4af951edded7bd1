"""Paths of the tool: how exactly random ones are followed, and what timing and turns of the tool save.

    python -m benchmarks.tool_paths --count 50
    python -m benchmarks.tool_paths --count 20 --corners
    python -m benchmarks.tool_paths --count 50 --about
    python -m benchmarks.tool_paths --count 20 --free goal
    python -m benchmarks.tool_paths --count 20 --free both

From random configurations of a UR5e a straight line leads 0.1 to 0.5 m in a random direction, and the tool turns by up
to 0.5 rad on the way. With `--corners` a second line of as much length follows, and the corner between them is rounded
within 40 mm. Paths are drawn until `--count` of them can be followed. `even speed` is the least energy of an even speed
on the same path at its fixed tool angle with smooth ramps, over durations and lengths of the ramps, within the limits
on speed, acceleration, jerk and torque, which the answers keep. `ramps of even acceleration` is the same with ramps of
a third each and without the limit on jerk, which no such ramp can keep. With `--about` the tool may turn about its own
axis between the ends of the path: `saved by turns` is against the answer at the fixed tool angle. With `--free goal`
the goal leaves this rotation free, too: `saved by turns` is against the answer at the fixed tool angle, whose end is
turned as little as may be, and `saved by free ends` against the answer with turns between this start and this end.
With `--free both` so does the start; then every branch of it is tried in all of these.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.energy.kernel_cache import compile_kernel
from joulepath.optimizer.energy.limited_torque import limited_torque
from joulepath.optimizer.exceptions import NoTrajectory, PathInfeasible
from joulepath.optimizer.kinematics.orientation_tolerance import nearest_orientation
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.search.baselines import motion_energy
from joulepath.optimizer.search.path_baselines import along
from joulepath.optimizer.solution import Solution
from joulepath.optimizer.trajectories import ramped
from joulepath.optimizer.trajectories.quadrature import lobatto_nodes
from joulepath.optimizer.trajectories.spline import Spline
from joulepath.optimizer.trajectories.time_scalings import SampledMotion, even_speed

MIDDLE = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
# spread of the joints of the start [rad], lengths [m], greatest turn [rad], blend of a corner [m]
SPREAD, LENGTHS, TURN, BLEND = 0.8, (0.1, 0.5), 0.5, 0.04
# durations of an even speed that are tried, in multiples of ours, and their number
DURATIONS, TRIED = (0.5, 6.0), 200
# axis of the TCP about which the tool may turn
TOOL_AXIS = (0.0, 0.0, 1.0)
# shares of the time that smooth ramps take, and quadrature panels in each phase
RAMPS, PANELS = (0.2, 0.3, 0.4, 0.5), 12


def tasks(seed: int, corners: bool) -> Iterator[Problem]:
    """Paths without end, each drawn by a generator of its own, whether the arm can follow them or not."""
    arm = Arm(robot=load_robot("ur5e"), collisions=False)
    for k in itertools.count():
        rng = np.random.default_rng([seed, k])
        q = MIDDLE + rng.uniform(-SPREAD, SPREAD, 6)
        via, goal = list[Pose](), _beyond(rng, tcp_pose(arm, q))
        if corners:
            via, goal = [Pose(goal)], _beyond(rng, goal)
        path = ToolPath(via=via, blend=BLEND if corners else 0.0)
        yield Problem(arm=arm, start=q, goal=Pose(goal), tool_path=path, deadline=60.0)


def _beyond(rng: np.random.Generator, T: Array) -> Array:
    """A pose at the end of a random line from another one."""
    direction, turn = rng.normal(size=(2, 3))
    goal = T.copy()
    goal[:3, 3] += rng.uniform(*LENGTHS) * direction / np.linalg.norm(direction)
    turned = Rotation.from_rotvec(rng.uniform(0, TURN) * turn / np.linalg.norm(turn))
    goal[:3, :3] = turned.as_matrix() @ T[:3, :3]
    return goal


def even(problem: Problem, found: Solution, ramps: tuple[float, ...]) -> float:
    """Least energy [J] of an even speed on the path of the answer, whose smooth `ramps` take such shares of the time;
    without any, with ramps of even acceleration and any jerk."""
    prepared, limits = PreparedProblem.of(problem), problem.arm.active_limits
    path = prepared.joint_path(found.start.q)
    assert path is not None
    least = np.inf
    for duration in found.trajectory.spline.duration * np.linspace(*DURATIONS, TRIED):
        laws = [smooth(path, float(duration), ramp) for ramp in ramps] or [along(path, even_speed(float(duration)))]
        for motion in laws:
            tau = prepared.torques(motion.q, motion.v, motion.a)
            limited = np.abs(limited_torque(problem.arm, tau, motion.v, motion.a)).max(axis=0)
            peaks, most = (motion.peak_v, motion.peak_a, limited), (limits.v_max, limits.a_max, limits.tau_max)
            held = all((a <= b).all() for a, b in zip(peaks, most, strict=True))
            if held and (not ramps or (motion.peak_jerk <= limits.j_max).all()):
                least = min(least, motion_energy(problem, motion, tau, prepared.potential).electrical.total)
    return float(least)


def smooth(path: Spline, duration: float, ramp: float) -> SampledMotion:
    """An even speed along a path over [0, 1]; in the ramps, of such a share of the time each, it is a cubic of time."""
    edges = [np.linspace(a, b, PANELS + 1) for a, b in ((0.0, ramp), (ramp, 1 - ramp), (1 - ramp, 1.0))]
    tau, weights = lobatto_nodes(np.unique(np.concatenate(edges)))
    x, speed = np.minimum(np.minimum(tau, 1 - tau) / ramp, 1.0), 1 / (1 - ramp)
    s, rising = ramped.fraction(tau, ramp), np.where(tau < 0.5, 1, -1) * (x < 1)
    r1, r2, r3 = (
        speed * (3 * x**2 - 2 * x**3),
        speed * rising * 6 * (x - x**2) / ramp,
        speed * 6 * (1 - 2 * x) / ramp**2,
    )
    r1, r2, r3 = r1 / duration, r2 / duration**2, np.where(x < 1, r3, 0.0) / duration**3
    d1, d2, d3 = (path.curve(s, k) for k in (1, 2, 3))
    v, a = d1 * r1[:, None], d2 * r1[:, None] ** 2 + d1 * r2[:, None]
    jerk = d3 * r1[:, None] ** 3 + 3 * d2 * (r1 * r2)[:, None] + d1 * r3[:, None]
    peaks = (np.abs(each).max(axis=0) for each in (v, a, jerk))
    return SampledMotion(tau * duration, weights * duration, path.curve(s), v, a, *peaks)


def measured(problem: Problem, about: bool, free: str | None) -> dict[str, float]:
    """The figures of one path, whose ends are `free`: the goal, or both. Raises PathInfeasible or NoTrajectory."""
    turning, free_start, free_goal = problem, None, None
    if about or free:
        path = problem.tool_path
        assert path is not None and isinstance(problem.goal, Pose)
        start = Pose(tcp_pose(problem.arm, np.asarray(problem.start)))
        if free:
            free_goal = ConeOrientedPose.about(problem.goal, np.array(TOOL_AXIS))
            before = path.via[-1].T if path.via else start.T
            problem = replace(problem, goal=free_goal.with_orientation(nearest_orientation(free_goal, before[:3, :3])))
        if free == "both":
            free_start = ConeOrientedPose.about(start, np.array(TOOL_AXIS))
            problem = replace(problem, start=start)
        turning = replace(problem, tool_path=replace(path, about=TOOL_AXIS))
    began = time.perf_counter()
    answer = fixed = optimize(problem)
    row = {"time [s]": time.perf_counter() - began}
    at_fixed_angle = fixed.energy.electrical.total
    if about or free:
        between = optimize(turning).energy.electrical.total if free else np.nan
        began = time.perf_counter()
        answer = optimize(replace(turning, start=free_start or turning.start, goal=free_goal or turning.goal))
        row = {"time [s]": time.perf_counter() - began}
        row["saved by turns"] = 1 - answer.energy.electrical.total / at_fixed_angle
        if free:
            row["saved by free ends"] = 1 - answer.energy.electrical.total / between
    ratio, energy = answer.certificate.worst_ratio, answer.energy.electrical.total
    row["gap"] = 1 - answer.lower_bound / energy
    row["deviation [m]"] = ratio["path_position"] * ToolPath().position_tolerance
    row["deviation [rad]"] = ratio["path_rotation"] * ToolPath().rotation_tolerance
    row["saved against even speed"] = 1 - energy / even(problem, fixed, RAMPS)
    row["ramps of even acceleration"] = 1 - energy / even(problem, fixed, ())
    return row


def main() -> None:
    """Follows paths, and prints deviations, times and savings."""
    arguments = parser(__doc__, seed=0)
    arguments.add_argument("--count", type=int, default=50, help="paths that can be followed (%(default)s)")
    arguments.add_argument("--corners", action="store_true", help="two lines with a rounded corner")
    arguments.add_argument("--about", action="store_true", help="the tool may turn about its own axis")
    arguments.add_argument("--free", choices=["goal", "both"], help="ends where its angle about this axis is free, too")
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    with suppress(PathInfeasible, NoTrajectory):
        optimize(next(tasks(given.seed + 1, given.corners)))  # loads what the others find loaded
    found: dict[str, list[float]] = {}
    refused, failed, held = 0, 0, 0
    for problem in tasks(given.seed, given.corners):
        try:
            row = measured(problem, given.about, given.free)
        except PathInfeasible:
            refused += 1
            continue
        except NoTrajectory:
            failed += 1
            continue
        held += 1
        for name, value in row.items():
            found.setdefault(name, []).append(float(value))
        if held == given.count:
            break
    print(f"{held} paths followed and certified, seed {given.seed}: {refused} others refused, {failed} not found")
    results = {name: Spread.of(values) for name, values in found.items()}
    for name, spread in results.items():
        print(f"{name:26s} {spread.formatted(digits=8 if 'deviation' in name else 5)}, least {spread.minimum:.5f}")
    write_json(given.json, {"seed": given.seed, "count": given.count, "refused": refused, "failed": failed} | results)


if __name__ == "__main__":
    main()
