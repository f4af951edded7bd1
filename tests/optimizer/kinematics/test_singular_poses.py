"""Singular poses: an edge of elbow or shoulder is an ordinary solution, a stretched wrist has a
self-motion.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.confirmed_inverse import INVERSE
from joulepath.optimizer.kinematics.ik_solutions import LimitedSolution
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.kinematics.six.ur_geometry import UR
from joulepath.optimizer.problem.branches import BranchFilter
from tests.optimizer.kinematics.flange import (
    ACCURACY,
    EVERYDAY,
    FOUND,
    IK,
    ROUNDING,
    errors,
    forward,
    joints,
)
from tests.optimizer.moves import ROBOT

# joint error at an edge of the workspace, the square root of a rounding of the pose by 1e-16 m
# [rad]
FOUND_ON_AN_EDGE = 2e-6
FORM = URClosedForm.of(ROBOT.model) or pytest.fail("the robot has a closed form")

angles = st.lists(st.floats(-3.1, 3.1), min_size=6, max_size=6).map(np.array)


def self_motions(solutions: list[LimitedSolution]) -> list[SelfMotion]:
    """Distinct self-motions of the solutions."""
    motions = (each.self_motion for each in solutions if each.self_motion is not None)
    return list(dict.fromkeys(motions))


def apart(a: Array, b: Array) -> Array:
    """Largest joint difference (n,) [rad] between configurations (n, nq) or (nq,), up to full
    turns.
    """
    return np.asarray(np.abs(np.exp(1j * a) - np.exp(1j * b)).max(axis=-1))


@given(q=angles, elbow=st.sampled_from([0.0, np.pi, -np.pi]))
# next to a stretched wrist
@example(q=np.array([0.0, 0.0, 0.0, 0.0, 2e-4, 0.0]), elbow=0.0)
@example(q=np.array([0.0, 0.0, 0.0, 0.0, 2e-4, 0.0]), elbow=np.pi)
@settings(deadline=None)
def test_a_singular_elbow_is_a_solution_like_any_other(q: Array, elbow: float) -> None:
    q[2] = elbow
    solutions = IK.solve(forward(q), windings=False)
    nearest = min(solutions, key=lambda each: float(apart(each.q, q)))
    if abs(np.sin(q[4])) < 1e-4:
        return  # wrist and elbow at once: the tests of self-motions
    # Next to a stretched wrist or a singular shoulder, the same rounding turns the fifth axis
    # further.
    ahead = min(1.0, max(abs(FORM.ahead(q)), UR.least_ahead))
    assert apart(nearest.q, q) < max(FOUND_ON_AN_EDGE, 5e-7 / np.sqrt(abs(np.sin(q[4])) * ahead))
    assert "elbow" in nearest.singular
    assert nearest.self_motion is None
    for part in ("up", "down"):
        assert BranchFilter(elbow=part).allows(nearest.label, nearest.singular)


def test_next_to_three_singularities_at_once_a_pose_is_answered() -> None:
    """Poses next to three singularities at once have accurate solutions.

    The elbow is stretched, and shoulder and wrist are nearly singular: rounding moves the pose out
    of reach.
    """
    rng, answered = np.random.default_rng(0), 0
    while answered < 150:
        q = rng.uniform(-2 * np.pi, 2 * np.pi, 6)
        q[2], q[4] = rng.choice([0, np.pi, -np.pi]), 10 ** rng.uniform(-4, -1) * rng.choice([-1, 1])
        # lift angles with a distance of a micrometre to a decimetre between the first and last axis
        lifts = np.linspace(-3, 3, 41)
        ahead = [FORM.ahead(np.array([q[0], lift, *q[2:]])) for lift in lifts]
        crossings = [k for k in range(40) if ahead[k] * ahead[k + 1] < 0]
        if not crossings:
            continue
        k = crossings[0]
        root = brentq(
            lambda lift, q=q: FORM.ahead(np.array([q[0], lift, *q[2:]])), lifts[k], lifts[k + 1]
        )
        q[1] = root + 10 ** rng.uniform(-6, -1) * rng.choice([-1, 1])
        T = forward(q)
        solutions = IK.solve(T, windings=False)
        assert solutions
        assert max(max(errors(T, each.q)) for each in solutions) < ACCURACY
        answered += 1


def test_an_edge_of_the_elbow_next_to_a_stretched_wrist_is_in_reach() -> None:
    """A pose at the edge of the elbow with a stretched wrist is in reach.

    Rounding turns the fifth axis, and might move the fourth axis out of reach.
    """
    rng = np.random.default_rng(1)
    for _ in range(500):
        q = rng.uniform(-3.1, 3.1, 6)
        q[2] = rng.choice([0, np.pi, -np.pi])
        q[3] = rng.choice([q[3], 0, np.pi / 2, -np.pi / 2, np.pi])
        q[4] = rng.choice([0, np.pi]) + rng.choice([-1, 1]) * 10 ** rng.uniform(-10, -3)
        solutions = IK.solve(forward(q), windings=False)
        assert solutions
        for each in solutions:
            assert max(errors(forward(q), each.q)) < ACCURACY


def test_on_an_edge_the_branches_that_meet_count_once() -> None:
    rng = np.random.default_rng(3)
    for q in rng.uniform(-3, 3, (200, 6)):
        q[2] = 0.0
        found = joints(IK.solve(forward(q), windings=False))
        assert (apart(found, q) < FOUND_ON_AN_EDGE).sum() == 1


def test_a_singular_shoulder_is_a_solution_like_any_other() -> None:
    """With the last axis beside the first, both shoulder branches are one regular solution."""
    rng = np.random.default_rng(8)
    for q in rng.uniform(-3, 3, (200, 6)):
        # The last axis' origin is level with the first axis: a2 c2 + a3 c23 + d5 s234 = 0, solved
        # for q4.
        ahead = -0.425 * np.cos(q[1]) - 0.3922 * np.cos(q[1] + q[2])
        if abs(ahead) > 0.0997:
            continue
        q[3] = np.arcsin(-ahead / 0.0997) - q[1] - q[2]
        solutions = IK.solve(forward(q), windings=False)
        nearest = min(solutions, key=lambda each: float(apart(each.q, q)))
        assert apart(nearest.q, q) < FOUND_ON_AN_EDGE
        assert "shoulder" in nearest.singular


@given(q=angles, wrist=st.sampled_from([0.0, np.pi, -np.pi]))
@settings(deadline=None)
def test_a_stretched_wrist_holds_its_pose_on_a_curve(q: Array, wrist: float) -> None:
    q[4] = wrist
    T = forward(q)
    solutions = IK.solve(T, windings=False)
    curves = self_motions(solutions)
    assert curves
    for motion in curves:
        own = [each for each in solutions if each.self_motion is motion]
        # Curves of both elbows share a member at their meeting point.
        assert len(own) >= INVERSE.members - 2
        for each in own:
            assert max(errors(T, each.q)) < ACCURACY
            assert "wrist" in each.singular
        moved = np.ptp(motion.at(np.linspace(*motion.arcs[0], 9)), axis=0)
        assert set(np.flatnonzero(moved > ROUNDING)) <= set(motion.free)
    # The configuration of the pose lies on one of the curves.
    members = [motion.at(np.array([motion.parameter(q)]))[0] for motion in curves]
    assert min(float(apart(member, q)) for member in members) < FOUND


@given(q=angles, seed=st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=50)
def test_boxes_hold_every_member_of_their_cell(q: Array, seed: int) -> None:
    q[4] = 0.0
    rng = np.random.default_rng(seed)
    for motion in self_motions(IK.solve(forward(q))):
        for lower, upper in motion.arcs:
            parameter = rng.uniform(lower, upper, 40)
            half = 10 ** rng.uniform(-5, 0, 40)
            centre, sides = motion.boxes(parameter, half)
            inside = np.clip(parameter + half * rng.uniform(-1, 1, 40), lower, upper)
            for at in (
                inside,
                np.clip(parameter + half, lower, upper),
                np.clip(parameter - half, lower, upper),
            ):
                away = motion.at(at) - centre
                away -= 2 * np.pi * np.round(away / (2 * np.pi))
                assert (np.abs(away) <= sides + ROUNDING).all()


def test_upright_all_singularities_meet_in_one_configuration() -> None:
    home = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
    solutions = IK.solve(forward(home), windings=False)
    # The wrist's self-motion has shrunk to a point, because the arm can reach no farther; rounding
    # leaves 1e-5 rad of it.
    assert apart(joints(solutions), home).max() < 1e-4
    for each in solutions:
        assert set(each.singular) == {"shoulder", "elbow", "wrist"}
        assert each.self_motion is None
        assert max(errors(forward(home), each.q)) < ACCURACY


def test_the_curve_and_the_isolated_solutions_beside_it_agree() -> None:
    """Just beyond the tolerance, two isolated solutions are near the curve of the singular pose."""
    for bend in (1e-9, 1e-8, 1e-6):
        q = np.array([0.4, -1.3, 1.5, 0.5, bend, 0.3])
        solutions = IK.solve(forward(q), windings=False)
        assert not self_motions(solutions)
        assert apart(joints(solutions), q).min() < FOUND
        stretched = q.copy()
        stretched[4] = 0.0
        curves = self_motions(IK.solve(forward(stretched), windings=False))
        near = [each.q for each in solutions if abs(np.sin(each.q[4])) < 2 * bend]
        assert len(near) >= 2
        for other in near:
            members = [motion.at(np.array([motion.parameter(other)]))[0] for motion in curves]
            assert min(float(apart(member, other)) for member in members) < 2 * bend + FOUND


def test_everyday_postures_are_not_singular() -> None:
    for solution in IK.solve(forward(EVERYDAY)):
        assert solution.singular == () and solution.self_motion is None


@pytest.mark.parametrize("members", [8, 24, 96])
def test_members_are_evenly_spread(members: int) -> None:
    q = np.array([0.4, -1.3, 1.5, 0.5, 0.0, 0.3])
    solutions = IK.solve(forward(q), windings=False, members=members)
    for motion in self_motions(solutions):
        own = joints([each for each in solutions if each.self_motion is motion])
        length = sum(upper - lower for lower, upper in motion.arcs)
        sixth = np.sort(own[:, 5] % (2 * np.pi))
        assert len(own) >= members
        # The largest step is even, except at gaps of the curve.
        assert np.diff(sixth).max() <= length / members + (2 * np.pi - length) + FOUND
