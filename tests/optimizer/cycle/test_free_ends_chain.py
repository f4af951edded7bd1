"""The bound of a cycle over all angles of the tool at the ends of a path: no chain of
configurations has less.
"""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    Arm,
    ConeOrientedPose,
    Cycle,
    Payload,
    Pose,
    Problem,
    Stop,
    StopPath,
    ToolPath,
    load_robot,
)
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.cycle import tool_turns
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.free_ends_chain import FreeEndsChain
from joulepath.optimizer.cycle.single_joint_bound import Boxes, SingleJointBound
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.kinematics.tool_path.least_time import least_tcp_distance, least_time
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.cycle.cycles import HOME, PART
from tests.optimizer.moves import AMPLE
from tests.selection import long_but

AXIS = np.array([0.0, 0.0, 1.0])
# angles of the tool in the attacks on a bound; rounding of energies [J]
ANGLES = 16
ROUNDING = 1e-6


def _cycle(seed: int, robot: str = "ur5e") -> Cycle:
    """A seam with a nozzle beside the flange, and a stop after it, both at random places."""
    rng = np.random.default_rng(seed)
    nozzle = Pose.from_quaternion([rng.uniform(0.0, 0.2), 0.0, 0.1], [0, 0, 0, 1]).T
    arm = Arm(robot=load_robot(robot), collisions=False, T_flange_tcp=nozzle)
    x, y, z = rng.uniform([0.4, -0.3, 0.15], [0.6, -0.1, 0.3])
    start, goal, after = (
        Pose.from_quaternion(at, [0.0, 1.0, 0.0, 0.0])
        for at in ((x, y, z), (x, y + 0.3, z), (0.1, 0.5, 0.2))
    )
    free_start, free_goal = (ConeOrientedPose.about(each, AXIS) for each in (start, goal))
    path = StopPath(
        goal=goal if seed % 3 == 1 else free_goal, path=ToolPath(about=(0.0, 0.0, 1.0)), speed=0.3
    )
    seam = Stop(name="seam", target=start if seed % 3 == 2 else free_start, path=path)
    return Cycle(
        arm=arm,
        start=HOME,
        stops=[seam, Stop(name="after", target=after)],
        windings=False,
        deadline=AMPLE,
    )


@pytest.fixture(autouse=True)
def few_angles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer angles than in a request, as the bound covers all angles anyway."""
    settings = replace(tool_turns.TOOL_TURNS, angles=(0.0, 2.0, 4.0))
    monkeypatch.setattr(tool_turns, "TOOL_TURNS", settings)


def _chain(asked: Cycle) -> FreeEndsChain:
    tried = {
        stop.name: tool_turns.turns_all_around(asked.arm, stop)
        for stop in asked.stops
        if any(stop.free_ends)
    }
    first = tool_turns.with_turns(asked, tried, bounded=True)
    chain = FreeEndsChain.of(first, CycleSearch(first, time.perf_counter).legs)
    assert chain is not None
    return chain


def _reaching(arm: Arm, end: Pose | ConeOrientedPose, rng: np.random.Generator) -> Array:
    """Configurations (n, 6) [rad] of a pose, at random angles if it is free."""
    given = (
        Pose.from_quaternion(end.position, [0.0, 1.0, 0.0, 0.0])
        if isinstance(end, ConeOrientedPose)
        else end
    )
    angles = rng.uniform(-np.pi, np.pi, ANGLES) if isinstance(end, ConeOrientedPose) else [0.0]
    form, found = URClosedForm.of(arm.robot.model), []
    assert form is not None
    for angle in angles:
        T = given.T.copy()
        T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(angle * AXIS).as_matrix()
        found += [form.solve(flange_pose(T, arm.T_flange_tcp))[0]]
    return np.concatenate(found)


def _least_of_some(asked: Cycle, chain: FreeEndsChain, rng: np.random.Generator) -> float:
    """The least bound [J] of chains of configurations at random angles.

    Consecutive configurations on the path are near each other.
    """
    path, legs = asked.stops[0].path, chain.legs
    assert path is not None
    entry, exit_ = (_reaching(asked.arm, end, rng) for end in (asked.stops[0].target, path.goal))
    e, g = (each.ravel() for each in np.indices((len(entry), len(exit_))))
    limits = asked.arm.active_limits
    q_goal = entry[e] + wrapped(exit_[g] - entry[e])
    within = ((q_goal >= limits.q_min) & (q_goal <= limits.q_max)).all(axis=1)
    bounds = [LeastBound(PreparedProblem.of(leg.prepared.freed())) for leg in legs]

    def between(k: int, a: Array, b: Array) -> Array:
        U = [np.array([legs[k].prepared.potential(each) for each in q]) for q in (a, b)]
        return np.asarray(bounds[k].of(b - a, U[1] - U[0]))

    to_entry = between(0, np.tile(HOME, (len(entry), 1)), entry)
    on_path = bounds[1].of(q_goal - entry[e], np.zeros(len(e)))
    order = np.argsort(np.where(within, to_entry[e] + on_path, np.inf), kind="stable")[:400]
    start, goal = entry[e[order]], q_goal[order]
    least = np.inf
    back = legs[3].least_costs[:, 0]
    for n, q in enumerate(legs[2].goal.q):
        onward = between(2, goal, np.tile(q, (len(goal), 1))) + back[n]
        least = min(least, float((to_entry[e[order]] + between(1, start, goal) + onward).min()))
    return least


@pytest.mark.parametrize(
    ("seed", "robot"),
    long_but([(2, "ur10e")], [(k, robot) for k in range(3) for robot in ("ur5e", "ur10e")]),
)
def test_no_chain_has_less(seed: int, robot: str) -> None:
    """The bound is below chains with free ends at the start or goal of the path, or both."""
    asked = _cycle(seed, robot)
    chain = _chain(asked)
    bound = chain.least(NEVER)
    found = _least_of_some(asked, chain, np.random.default_rng(seed))
    assert 0 < bound <= found + ROUNDING
    # the bound is also near the found energy
    assert bound > 0.85 * found


def test_the_quick_bound_is_no_more_than_the_bound() -> None:
    rng, arm = np.random.default_rng(0), Arm(robot=load_robot("ur5e"))
    bound = LeastBound(
        PreparedProblem.of(Problem(arm=arm, start=HOME, goal=HOME + 0.1, duration_min=1.0))
    )
    quick = SingleJointBound(bound, -30.0, 40.0)
    a, b = (
        Boxes(rng.uniform(-6, 6, (30, 6)), rng.uniform(0, 0.3, (30, 6)), rng.random((30, 6)) < 0.5)
        for _ in range(2)
    )
    gain = rng.uniform(-30.0, 60.0, (30, 30))
    found = quick.between(a, b, gain)
    # random points of the boxes, with random full turns of unplaced joints
    qa, qb = (x.centre + rng.uniform(-1, 1, x.half.shape) * x.half for x in (a, b))
    apart = qb[None] - qa[:, None]
    apart = np.where(a.placed[:, None] & b.placed, apart, wrapped(apart))
    exact = bound.of(apart.reshape(-1, 6), gain.ravel()).reshape(gain.shape)
    assert (found <= exact + ROUNDING).all() and np.isfinite(found).all()


@pytest.mark.parametrize("shape", ["line", "corner", "arc"])
def test_no_way_within_the_tolerance_is_shorter_than_the_least(shape: str) -> None:
    """A motion that cuts every corner by the tolerance still has the least length."""
    rng = np.random.default_rng(0)
    poses = [
        Pose.from_quaternion(at, [0.0, 1.0, 0.0, 0.0])
        for at in ([0.5, -0.2, 0.2], [0.6, 0.0, 0.25], [0.5, 0.2, 0.2])
    ]
    kinds = {
        "line": {},
        "corner": {"via": poses[1:2], "blend": 0.03},
        "arc": {"via": poses[1:2], "shape": "arc"},
    }
    for tolerance in (1e-4, 5e-3):
        path = ToolPath(**kinds[shape], position_tolerance=tolerance)
        course = ToolCourse.of(path, poses[0].T, poses[2].T)
        least = least_tcp_distance(course)
        for _ in range(2):
            at = np.unique(np.concatenate([[0.0, 1.0], rng.random(rng.integers(1, 40))]))
            points = course.poses(at)[:, :3, 3]
            way = np.linalg.norm(
                np.diff(course.poses(np.linspace(0, 1, 2000))[:, :3, 3], axis=0), axis=1
            ).sum()
            assert least <= way + 1e-9
            # straight from one to the next, as near to the inside as the tolerance allows
            moved = points + rng.normal(size=points.shape) * tolerance / 4
            moved[[0, -1]] = points[[0, -1]]
            if (
                course.deviation(
                    np.array([Pose.from_quaternion(p, [0, 1, 0, 0]).T for p in _dense(moved)])
                )[0].max()
                <= tolerance
            ):
                assert np.linalg.norm(np.diff(moved, axis=0), axis=1).sum() >= least
    arm = Arm(robot=load_robot("ur5e"))
    assert least_time(arm, course) == 0.0
    assert least_time(replace(arm, tcp_speed=0.1), course) == pytest.approx(
        least_tcp_distance(course) / 0.1, rel=1e-5
    )


def _dense(points: Array) -> Array:
    """Points (n, 3) on the straight lines between some."""
    at = np.linspace(0.0, len(points) - 1.0, 400)
    return np.stack([np.interp(at, np.arange(len(points)), each) for each in points.T], axis=1)


@pytest.mark.parametrize("seed", long_but([0], range(8)))
def test_no_chain_through_free_stops_has_less(seed: int) -> None:
    """Two stops with a free angle, and a payload in between, against chains of configurations.

    The chains use many angles, all configurations and full turns.
    """
    rng = np.random.default_rng(seed)
    arm = Arm(robot=load_robot("ur5e"), collisions=False)
    ends = [
        ConeOrientedPose.about(Pose.from_quaternion(at, [0.0, 1.0, 0.0, 0.0]), AXIS)
        for at in rng.uniform([0.3, -0.4, 0.15], [0.55, 0.4, 0.4], (2, 3))
    ]
    stops = [
        Stop(name=str(k), target=end, payload=(PART, Payload())[k]) for k, end in enumerate(ends)
    ]
    chain = _chain(Cycle(arm=arm, start=HOME, stops=stops, deadline=AMPLE))
    places = [HOME[None], *(_reaching(arm, end, rng) for end in ends), HOME[None]]
    least = np.zeros(1)
    for leg, (a, b) in zip(chain.legs, pairwise(places), strict=True):
        U = [np.array([leg.prepared.potential(each) for each in q]) for q in (a, b)]
        apart, gain = (
            wrapped(b[None] - a[:, None]).reshape(-1, 6),
            (U[1][None] - U[0][:, None]).ravel(),
        )
        between = (
            LeastBound(PreparedProblem.of(leg.prepared.freed()))
            .of(apart, gain)
            .reshape(len(a), len(b))
        )
        least = (least[:, None] + between).min(axis=0)
    bound = chain.least(NEVER)
    assert 0 < bound <= float(least[0]) + ROUNDING
    assert bound > 0.8 * float(least[0])
