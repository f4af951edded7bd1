"""The candidates of a search equal a full enumeration; infeasible ends rule candidates out."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    BranchFilter,
    Obstacle,
    Payload,
    Problem,
    Scene,
    Sphere,
    TorqueInfeasible,
    UnreachablePose,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search import candidates as search
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.ends import ends
from tests.optimizer.moves import (
    GOAL,
    ROBOT,
    START,
    changed,
    limits,
    problem,
    problem_with,
    tcp_pose,
    torques,
)
from tests.selection import long_but

TURN = 2 * np.pi
TURNS = TURN * np.array(list(product((-2, -1, 0, 1, 2), repeat=6)))
SAME = 1e-6  # rad; inverse kinematics agrees with itself to 1e-9
NARROW = limits(
    q_min=[-3.6, -3.6, -np.pi, -3.6, -3.6, -3.6], q_max=[3.6, 3.6, np.pi, 3.6, 3.6, 3.6]
)


def candidates(task: Problem) -> list[Candidate]:
    made = PreparedProblem.of(task)
    return search.pairs(made, ends(made, "start")[0], ends(made, "goal")[0])


def every_configuration(q: Array, task: Problem) -> list[Array]:
    """All configurations at the pose of q, by brute force.

    Tries every branch with every combination of full turns inside the joint limits.
    """
    own, found = task.arm.active_limits, []
    for branch in inverse_kinematics_for(task.arm.robot).branches(tcp_pose(q).T):
        turned = branch.q + TURNS
        inside = (turned >= own.q_min - 1e-9) & (turned <= own.q_max + 1e-9)
        found += list(turned[inside.all(axis=1)])
    return found


def rounded(rows: list[Array]) -> set[tuple[float, ...]]:
    """The rows of an array of angles as a set, in which equal rows up to rounding count once."""
    return {tuple((np.round(row, 5) + 0.0).tolist()) for row in rows}


def test_joints_to_joints_is_one_candidate() -> None:
    (only,) = candidates(problem())
    assert only.q_start.tolist() == START.tolist() and only.q_goal.tolist() == GOAL.tolist()
    labels = inverse_kinematics_for(ROBOT)
    assert (only.start.label, only.goal.label) == (
        str(labels.label(START)),
        str(labels.label(GOAL)),
    )


@pytest.mark.parametrize("own", [ROBOT.limits, NARROW], ids=["two turns", "one and a bit"])
def test_windings_of_a_goal_are_complete(own: Any) -> None:
    """From given joints, the candidates are all branches with all allowed full turns, once."""
    task = problem(goal=tcp_pose(GOAL), limits=own)
    found = [candidate.q_goal for candidate in candidates(task)]
    expected = every_configuration(GOAL, task)
    assert len(found) == len(expected) == len(rounded(found))
    distances = np.abs(np.array(found)[:, None] - np.array(expected)[None]).max(axis=2)
    assert distances.min(axis=0).max() < SAME and distances.min(axis=1).max() < SAME
    assert all(candidate.q_start.tolist() == START.tolist() for candidate in candidates(task))


def test_windings_of_a_start_are_complete() -> None:
    task = problem(start=tcp_pose(START), limits=NARROW)
    found = [candidate.q_start for candidate in candidates(task)]
    assert rounded(found) == rounded(every_configuration(START, task))
    assert len(found) == len(rounded(found))


def test_without_windings_every_branch_goes_the_shortest_way() -> None:
    """Without windings, every joint of a candidate takes its shortest way within the limits."""
    for own in (ROBOT.limits, NARROW):
        task = problem(goal=tcp_pose(GOAL), limits=own, windings=False)
        found = candidates(task)
        everything = every_configuration(GOAL, task)
        assert len(found) == len({candidate.goal.label for candidate in found}) == 8
        for candidate in found:
            siblings = [
                q for q in everything if np.abs(np.sin((q - candidate.q_goal) / 2)).max() < SAME
            ]
            least = np.min([np.abs(q - START) for q in siblings], axis=0)
            assert np.abs(candidate.q_goal - START) == pytest.approx(least, abs=SAME)


def test_between_poses_relative_travels_are_distinct() -> None:
    """Among pairs with the same displacement, one is kept.

    The same full turn at both ends changes nothing.
    """
    task = problem(start=tcp_pose(START), goal=tcp_pose(GOAL))
    found = candidates(task)
    labels = {(candidate.start.label, candidate.goal.label) for candidate in found}
    assert len(labels) == 64
    assert len(rounded([e.q_goal - e.q_start for e in found])) == len(found)
    for candidate in found:
        assert (candidate.q_start >= ROBOT.limits.q_min).all() and (
            candidate.q_goal <= ROBOT.limits.q_max
        ).all()


@pytest.mark.parametrize("own", [ROBOT.limits, NARROW], ids=["two turns", "one and a bit"])
def test_between_poses_every_joint_may_go_either_way_round(own: Any) -> None:
    """Between two poses, every joint may turn either way around.

    For every branch pair, the candidates cover all displacements below a full turn inside the
    limits.
    """
    task = problem(start=tcp_pose(START), goal=tcp_pose(GOAL), limits=own)
    found: dict[tuple[str, str], list[Candidate]] = {}
    for candidate in candidates(task):
        found.setdefault((candidate.start.label, candidate.goal.label), []).append(candidate)
    for group in found.values():
        travels = np.array([candidate.q_goal - candidate.q_start for candidate in group])
        for j in range(6):
            turns = TURN * np.arange(-2, 3)
            inside = [
                [q for q in each[j] + turns if own.q_min[j] <= q <= own.q_max[j]]
                for each in (group[0].q_start, group[0].q_goal)
            ]
            possible = {round(b - a, 6) for a, b in product(*inside) if abs(b - a) < TURN - SAME}
            assert possible <= {round(displacement, 6) for displacement in travels[:, j].tolist()}
        assert len(travels) == np.prod(
            [len(set(np.round(travels[:, j], 6).tolist())) for j in range(6)]
        )


@pytest.mark.parametrize("count", long_but((200,), (200, 2000)))
@pytest.mark.parametrize("own", [ROBOT.limits, NARROW], ids=["two turns", "one and a bit"])
def test_between_poses_nothing_that_may_be_best_is_missing(own: Any, count: int) -> None:
    """Every pair of configurations has a candidate with at most its displacement in every joint.

    The two displacements differ by full turns only.
    """
    task = problem(start=tcp_pose(START), goal=tcp_pose(GOAL), limits=own)
    kept = np.array([candidate.q_goal - candidate.q_start for candidate in candidates(task)])
    starts, goals = every_configuration(START, task), every_configuration(GOAL, task)
    rng = np.random.default_rng(1)
    for _ in range(count):
        displacement = goals[rng.integers(len(goals))] - starts[rng.integers(len(starts))]
        alike = np.abs(np.sin((kept - displacement) / 2)).max(axis=1) < SAME
        no_further = (np.abs(kept) <= np.abs(displacement) + SAME).all(axis=1)
        assert (alike & no_further).any()


@pytest.mark.parametrize(
    "wanted",
    [
        {"shoulder": "left"},
        {"elbow": "up", "wrist": "flip"},
        {"shoulder": "right", "elbow": "down"},
        {},
    ],
)
def test_a_branch_filter_keeps_what_it_names(wanted: dict[str, Any]) -> None:
    """The filter applies to ends given as poses; ends given as joints are never filtered."""
    given = BranchFilter(**wanted)
    everything = candidates(problem(start=tcp_pose(START), goal=tcp_pose(GOAL)))
    found = candidates(problem(start=tcp_pose(START), goal=tcp_pose(GOAL), branch=given))

    def kept(label: str) -> bool:
        return all(part in label.split("/") for part in wanted.values())

    expected = {
        (e.start.label, e.goal.label)
        for e in everything
        if kept(e.start.label) and kept(e.goal.label)
    }
    assert {(e.start.label, e.goal.label) for e in found} == expected
    assert len(candidates(problem(branch=given))) == 1


def test_a_branch_that_does_not_reach_the_pose_is_refused() -> None:
    """A limited elbow excludes one branch of the pose; a request for this branch is an error."""
    bent = replace(ROBOT.limits, q_min=np.where(np.arange(6) == 2, 1e-3, ROBOT.limits.q_min))
    one_elbow = problem(goal=tcp_pose(GOAL), limits=bent)
    reached = {tuple(candidate.goal.label.split("/")[:2]) for candidate in candidates(one_elbow)}
    assert 0 < len(reached) < 4
    for shoulder, elbow in {
        ("left", "up"),
        ("left", "down"),
        ("right", "up"),
        ("right", "down"),
    } - reached:
        branch = BranchFilter(shoulder=shoulder, elbow=elbow)  # type: ignore[arg-type]
        with pytest.raises(UnreachablePose) as refusal:
            candidates(replace(one_elbow, branch=branch))
        assert refusal.value.target == "goal"


def test_torque_that_cannot_hold_an_end_rules_it_out() -> None:
    """If no end can be held, the message names the joint, its required and its available torque."""
    weak = limits(tau_max=[150, 5, 150, 28, 28, 28])
    task = PreparedProblem.of(problem(limits=weak))
    with pytest.raises(TorqueInfeasible) as refusal:
        search.bound(task, candidates(task.problem))
    error = refusal.value
    assert error.joint == ROBOT.joint_names[1] and error.available == 5 and error.needed > 5
    some = PreparedProblem.of(
        problem(
            goal=tcp_pose(GOAL),
            payload=Payload(mass=5),
            collisions=False,
            limits=limits(tau_max=[150, 80, 150, 28, 28, 28]),
        )
    )
    found = candidates(some.problem)
    search.bound(some, found)
    for candidate in found:
        needed = np.abs(
            torques(some.problem, candidate.q_goal[None], np.zeros((1, 6)), np.zeros((1, 6)))
        )[0, 1]
        assert candidate.status == ("unvisited" if needed <= 80 else "infeasible")
        assert candidate.status == "unvisited" or (
            ROBOT.joint_names[1] in candidate.message and np.isinf(candidate.lower_bound)
        )
    assert {candidate.status for candidate in found} == {"infeasible", "unvisited"}


# clearance [m] at an end, smaller than the planning margin, and the clearance of a ball in contact
TOO_NEAR = 1e-4
TOUCHING = -1e-4


def beside_goal(asked: Problem, clearance: float) -> Problem:
    """The problem with a ball beside the elbow at GOAL.

    The ball lies on the axis of the elbow and leaves the arm the given clearance [m] at GOAL.
    """
    low, high = 0.0, 1.0
    data = ROBOT.model.createData()
    pin.forwardKinematics(ROBOT.model, data, GOAL)
    T = data.oMi[3].homogeneous

    def with_ball(away: float) -> Problem:
        place = np.eye(4)
        place[:3, 3] = T[:3, 3] + (0.05 + away) * T[:3, 2]
        ball = Obstacle("ball", Sphere(0.05), place, margin=0.0)
        return changed(asked, scene=Scene([ball]))

    for _ in range(40):
        middle = (low + high) / 2
        near = CollisionModel(with_ball(middle).arm).least_distance(GOAL[None], 0.1) < clearance
        low, high = (middle, high) if near else (low, middle)
    return with_ball(high)


def test_an_end_whose_clearance_is_too_small_to_plan_for_counts_in_the_bound() -> None:
    """An end with a clearance below the planning margin still counts in the lower bound.

    Motions to this end may need less energy than the answer, so the answer is not reported as
    optimal. A baseline may be such a motion.
    """
    asked = problem_with(START, tcp_pose(GOAL), windings=False)
    free = optimize(asked)
    assert np.allclose(free.goal.q, GOAL)
    near = optimize(beside_goal(asked, TOO_NEAR))
    assert near.lower_bound <= free.energy.electrical.total < near.energy.electrical.total
    assert near.status == "feasible"
    touched = optimize(beside_goal(asked, TOUCHING))
    (ruled,) = [each for each in touched.candidates if np.allclose(each.q_goal, GOAL)]
    assert ruled.status == "infeasible" and "ball" in ruled.reason and np.isinf(ruled.lower_bound)
    assert touched.lower_bound > near.lower_bound and touched.status == "optimal"
