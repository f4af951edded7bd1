"""Answers to goals of partly free orientation: energy, conditions, deadline and errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import (
    AnyOf,
    BranchFilter,
    Bus,
    ConeOrientedPose,
    Dwell,
    Payload,
    Pose,
    Solution,
    UnreachablePose,
    UnreachableTargets,
    optimize,
)
from joulepath.optimizer.search.finishing_time import FINISHING
from joulepath.optimizer.search.sampled_ends import SAMPLES
from tests.optimizer.clocks import LAST_READINGS, CountingClock
from tests.optimizer.moves import (
    GOAL,
    HOME,
    PAYLOAD,
    START,
    TILTED,
    fixed,
    paper_poses,
    problem,
    tcp_pose,
)
from tests.optimizer.search.runs import prepared
from tests.optimizer.search.test_free_goal import TOOL, angle
from tests.refusals import refusal_of
from tests.selection import long_but

# the certificate's, of positions [m] and angles [rad]
HELD = 1e-6
# relative: a search with turns from a few samples against the best of many separately refined poses
FOUND = 5e-3
POSITIONS = [paper_poses()[k] for k in (0, 5, 10)]


def energy(solution: Solution) -> float:
    return solution.energy.electrical.total


@pytest.mark.long
@pytest.mark.parametrize("number", range(3))
def test_what_is_freer_costs_no_more(number: int) -> None:
    """At the paper's positions, more freedom never needs more energy.

    The order is: free ≤ cone ≤ turned about the axis ≤ fixed, and free ≤ the best of five
    orientations.
    """
    pose = POSITIONS[number]
    position, direction = pose.T[:3, 3], pose.T[:3, 2]
    about = optimize(problem(HOME, ConeOrientedPose.about(pose, [0, 0, 1])))
    cone = optimize(problem(HOME, ConeOrientedPose(position, [0, 0, 1], direction, 0.3)))
    free = optimize(problem(HOME, ConeOrientedPose(position)))
    five = optimize(problem(HOME, AnyOf(tuple(paper_poses()[5 * number : 5 * number + 5]))))
    full = optimize(problem(HOME, pose))
    for solution, most in ((about, 0.0), (cone, 0.3), (free, np.pi)):
        reached = tcp_pose(solution.goal.q).T
        assert solution.certificate.valid
        assert np.linalg.norm(reached[:3, 3] - position) < HELD
        assert angle(reached[:3, 2], direction) <= most + HELD
        assert 0 <= solution.lower_bound <= energy(solution)
        assert len(solution.candidates) >= 8 and solution.status == "feasible"
    assert energy(free) <= energy(cone) * (1 + FOUND) <= energy(about) * (1 + FOUND) ** 2
    assert energy(about) <= energy(full) * (1 + FOUND)
    assert energy(free) <= energy(five) * (1 + FOUND)


CONDITIONS: dict[str, dict[str, Any]] = {
    "tool and payload": {"T_flange_tcp": TOOL, "payload": PAYLOAD},
    "tilted": {"gravity": TILTED},
    "time scaling": {"method": "time_scaling"},
    "mechanical": {"objective": "mechanical", **fixed(2.0)},
    "start is a pose": {"start": tcp_pose(START)},
    "kept branch": {"branch": BranchFilter(elbow="up")},
}


@pytest.mark.parametrize("condition", long_but(("tool and payload",), CONDITIONS))
def test_holds_under(condition: str) -> None:
    """Answers for a cone about a tool axis are in place, in the cone and above the bound."""
    given = {"payload": Payload(mass=0.5)} | CONDITIONS[condition]
    tool = given.get("T_flange_tcp", np.eye(4))
    T = tcp_pose(GOAL, tool).T
    axis = np.array([0.0, 1.0, 1.0])
    direction = T[:3, :3] @ axis
    solution = optimize(problem(goal=ConeOrientedPose(T[:3, 3], axis, direction, 0.25), **given))
    reached = tcp_pose(solution.goal.q, tool).T
    assert solution.certificate.valid and max(solution.certificate.goal_error) < HELD
    assert np.linalg.norm(reached[:3, 3] - T[:3, 3]) < HELD
    assert angle(reached[:3, :3] @ axis, direction) <= 0.25 + HELD
    spent = solution.energy.mechanical.total if condition == "mechanical" else energy(solution)
    assert solution.lower_bound <= spent
    if condition == "kept branch":
        assert solution.goal.label.split("/")[1] == "up"


def test_out_of_reach_in_every_orientation() -> None:
    far = ConeOrientedPose(np.array([2.0, 0.0, 0.3]))
    with pytest.raises(UnreachablePose) as refusal:
        optimize(problem(goal=far))
    assert refusal.value.distance is not None and 0.5 < refusal.value.distance < 1.5
    assert "each of the 96 orientations" in str(refusal.value)
    with pytest.raises(UnreachableTargets):
        optimize(problem(goal=AnyOf((far, far))))


def test_no_sample_is_activated_after_the_deadline() -> None:
    """After the deadline, the search activates at most one batch of samples.

    There are thousands of deferred samples, and every batch is a search of its own.
    """
    rng, clock = np.random.default_rng(2), CountingClock(0.0)
    starts = AnyOf(tuple(HOME + rng.normal(scale=0.3, size=6) for _ in range(12)))
    run = prepared(problem(starts, ConeOrientedPose(tcp_pose(GOAL).T[:3, 3])), clock=clock)
    deferred = [each for each in run.state.candidates if each.deferred]
    assert len(deferred) > 1000
    clock.now += 1e6
    run.explore()
    assert sum(each.deferred for each in deferred) >= len(deferred) - SAMPLES.batch


def test_mixes_with_full_targets() -> None:
    """A nearby goal in joints wins against a distant free orientation.

    The candidates still include the free orientation.
    """
    solution = optimize(
        problem(goal=AnyOf((ConeOrientedPose(tcp_pose(GOAL).T[:3, 3]), START + 0.02)))
    )
    assert solution.goal.target == 1
    assert {candidate.goal_target for candidate in solution.candidates} == {0, 1}


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: ConeOrientedPose([0.1, 0.2]), "pose.position"),
        (lambda: ConeOrientedPose([0.1, 0.2, np.nan]), "pose.position"),
        (lambda: ConeOrientedPose([0, 0, 1], [0, 0, 0]), "pose.orientation.axis"),
        (lambda: ConeOrientedPose([0, 0, 1], [0, 0, 1], [0, 0, 0]), "pose.orientation.direction"),
        (
            lambda: ConeOrientedPose([0, 0, 1], [0, 0, 1], [0, 0, 1], 3.2),
            "pose.orientation.half_angle",
        ),
        (
            lambda: ConeOrientedPose([0, 0, 1], [0, 0, 1], [0, 0, 1], np.nan),
            "pose.orientation.half_angle",
        ),
        (lambda: ConeOrientedPose.about(Pose(np.eye(4)), [0, np.inf, 0]), "pose.orientation.axis"),
        (lambda: problem(start=ConeOrientedPose([0.4, 0, 0.3])), "start"),
        (lambda: problem(start=AnyOf((START, ConeOrientedPose([0.4, 0, 0.3])))), "start"),
    ],
)
def test_what_is_malformed_is_refused(make: Any, field: str) -> None:
    with refusal_of(field):
        make()


def test_respects_the_deadline() -> None:
    """With a pose as the start too, the answer comes a few clock readings after the deadline."""
    readings = 60
    task = problem(
        tcp_pose(START), ConeOrientedPose(tcp_pose(GOAL).T[:3, 3]), deadline=float(readings)
    )
    solution = optimize(task, CountingClock())
    assert solution.certificate.valid and solution.status == "feasible"
    assert readings - FINISHING.least < solution.solver.wall_time < readings + LAST_READINGS
    assert any(each.status == "unvisited" for each in solution.candidates)


@pytest.mark.parametrize(
    "given",
    [
        pytest.param({"dwell": Dwell(time=4.0, hold="motors")}, marks=pytest.mark.long),
        pytest.param(
            {"dwell": Dwell(time=4.0, hold="brakes", brake_delay=0.3)}, marks=pytest.mark.long
        ),
        pytest.param(
            {"bus": Bus(mode="storage", capacity=20.0, efficiency=0.9)}, marks=pytest.mark.long
        ),
        pytest.param({"bus": Bus(mode="isolated")}, marks=pytest.mark.long),
    ],
    ids=str,
)
def test_waiting_and_every_bus_count(given: dict[str, Any]) -> None:
    """Comparison and bound include the energy for waiting at the goal."""
    T = tcp_pose(GOAL).T
    pose = ConeOrientedPose(T[:3, 3], [0, 0, 1], T[:3, 2], 0.4)
    free, full = (
        optimize(problem(goal=goal, payload=PAYLOAD, **given)) for goal in (pose, Pose(T))
    )
    assert free.certificate.valid
    assert free.lower_bound <= energy(free) <= energy(full) * (1 + FOUND)
