"""Inverse kinematics against Pinocchio's forward kinematics, and against numerical solvers without
branches.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.inverse import (
    inverse_kinematics_for,
    required_inverse_kinematics,
)
from joulepath.optimizer.kinematics.reach import REACH
from tests.optimizer.kinematics.flange import (
    ACCURACY,
    DATA,
    EVERYDAY,
    FLANGE,
    FOUND,
    IK,
    LIMITS,
    MODEL,
    ROUNDING,
    errors,
    forward,
    jacobian,
    joints,
    pose,
)
from tests.optimizer.moves import ROBOT

# smallest singular value of two coinciding singularities, with metres and radians mixed
DOUBLE = 6e-8
# movement along the direction lost at a fold [rad]; it changes the pose by the square, about 1e-6 m
BESIDE = 1e-3
# all digits: squared errors of 1e-7 m end a search early
SEARCH = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "x_scale": "jac"}

angles = st.lists(st.floats(-2 * np.pi, 2 * np.pi), min_size=6, max_size=6).map(np.array)


@pytest.mark.parametrize("count", [300, pytest.param(3_000, marks=pytest.mark.long)])
def test_configurations_inside_the_limits(count: int) -> None:
    rng = np.random.default_rng(20240501)
    for q in rng.uniform(LIMITS.q_min, LIMITS.q_max, (count, 6)):
        T = forward(q)
        solutions = IK.solve(T)
        found = joints(solutions)
        distance = np.abs(found - q).max(axis=1)
        assert distance.min() < FOUND
        assert solutions[int(distance.argmin())].label == IK.label(q)
        assert (found >= LIMITS.q_min).all()
        assert (found <= LIMITS.q_max).all()

        # Solutions of one label are distinct full turns of one configuration.
        first = {solution.label: solution for solution in reversed(solutions)}
        turns = (found - np.array([first[solution.label].q for solution in solutions])) / (
            2 * np.pi
        )
        assert np.abs(turns - turns.round()).max() < ROUNDING
        keys = np.column_stack(
            [[list(first).index(solution.label) for solution in solutions], turns.round()]
        )
        assert len(np.unique(keys, axis=0)) == len(solutions)
        # Solutions with different labels are different, and all solutions reach the pose.
        branches = joints(list(first.values()))
        apart = np.abs(np.exp(1j * branches[:, None]) - np.exp(1j * branches[None])).max(axis=2)
        assert (apart + np.eye(len(branches))).min() > FOUND
        for branch in first.values():
            assert max(errors(T, branch.q)) < ACCURACY or is_nearest_at_the_edge(T, branch.q)


def is_nearest_at_the_edge(T: Array, q: Array) -> bool:
    """Whether the pose is out of reach only within the tolerance of `Reach`.

    Searches from both sides of the fold at q then find no configuration nearer to the pose.
    """
    error = max(errors(T, q))
    least = np.linalg.svd(jacobian(q))[2][-1]
    searches = [
        least_squares(lambda x: (forward(x) - T).ravel(), q + beside * least, **SEARCH).x
        for beside in (-BESIDE, BESIDE)
    ]
    nearest = min(max(errors(T, x)) for x in searches)
    return error < REACH.residual and error < nearest + ROUNDING


def test_near_singular_configurations_are_found_to_the_same_accuracy() -> None:
    rng = np.random.default_rng(7)
    for _ in range(500):
        q = rng.uniform(LIMITS.q_min, LIMITS.q_max)
        q[rng.choice([2, 4])] = rng.choice([-1, 1]) * 10 ** rng.uniform(-6, -2)
        # Two singularities multiply: a pose rounded to double precision then determines the joints
        # less accurately.
        if np.linalg.svd(jacobian(q), compute_uv=False)[-1] < DOUBLE:
            continue
        assert np.abs(joints(IK.solve(forward(q))) - q).max(axis=1).min() < FOUND


def test_reports_singular_value_and_limit_distance() -> None:
    for solution in IK.solve(forward(EVERYDAY)):
        assert solution.smallest_singular_value == pytest.approx(
            np.linalg.svd(jacobian(solution.q), compute_uv=False)[-1], abs=1e-12
        )
        assert solution.limit_distance == min(
            (solution.q - LIMITS.q_min).min(), (LIMITS.q_max - solution.q).min()
        )


def test_no_solution_is_missing_that_a_numerical_search_finds() -> None:
    rng = np.random.default_rng(11)
    converged = 0
    for goal in rng.uniform(-np.pi, np.pi, (15, 6)):
        T = forward(goal)
        known = joints(IK.solve(T, windings=False))
        for q in rng.uniform(-np.pi, np.pi, (20, 6)):
            for _ in range(60):
                step = pin.log6(pin.SE3(forward(q)).actInv(pin.SE3(T))).vector
                local = pin.computeFrameJacobian(MODEL, DATA, q, FLANGE, pin.LOCAL)
                q = q + np.clip(
                    local.T @ np.linalg.solve(local @ local.T + 1e-9 * np.eye(6), step), -0.5, 0.5
                )
            if max(errors(T, q)) < ACCURACY:
                converged += 1
                assert np.abs(np.exp(1j * known) - np.exp(1j * q)).max(axis=1).min() < FOUND
    assert converged > 100


def test_tcp_is_what_reaches_the_pose() -> None:
    T_flange_tcp = pose([0.02, -0.05, 0.18], pin.rpy.rpyToMatrix(0.3, -0.7, 1.1))
    T_base_tcp = forward(EVERYDAY) @ T_flange_tcp
    solutions = IK.solve(T_base_tcp, T_flange_tcp)
    assert np.abs(joints(solutions) - EVERYDAY).max(axis=1).min() < FOUND
    for solution in solutions:
        assert np.abs(forward(solution.q) @ T_flange_tcp - T_base_tcp).max() < ACCURACY


def test_labels_say_where_the_elbow_and_the_arm_are() -> None:
    """Labels agree with the height of the elbow and the side of the offset, computed from frames.

    The arms reach well ahead.
    """
    checked = 0
    for q in np.random.default_rng(3).uniform(-np.pi, np.pi, (500, 6)):
        pin.forwardKinematics(MODEL, DATA, q)
        shoulder, elbow, wrist, end = (DATA.oMi[j].translation for j in (2, 3, 4, 6))
        side = DATA.oMi[2].rotation[:, 2]
        wrist = wrist - side * ((wrist - shoulder) @ side)
        reach = wrist - shoulder
        ahead = end - side * ((end - shoulder) @ side) - shoulder
        if np.linalg.norm(reach[:2]) < 0.2 or ahead[:2] @ reach[:2] < 0:
            continue
        checked += 1
        share = (elbow - shoulder)[:2] @ reach[:2] / (reach[:2] @ reach[:2])
        above = (elbow - shoulder)[2] - share * reach[2]
        left = np.array([-reach[1], reach[0], 0.0]) @ side
        label = IK.label(q)
        assert label.elbow == ("up" if above > 0 else "down")
        assert label.shoulder == ("left" if left > 0 else "right")
        assert label.wrist == ("no_flip" if np.sin(q[4]) < 0 else "flip")
    assert checked > 100


@given(q=angles, turns=st.lists(st.integers(-2, 2), min_size=6, max_size=6))
def test_a_full_turn_keeps_the_label(q: Array, turns: list[int]) -> None:
    assume(abs(np.linalg.det(jacobian(q))) > 1e-6)
    assert IK.label(q + 2 * np.pi * np.array(turns)) == IK.label(q)


@given(q=angles)
@settings(deadline=None)
def test_windings_are_full_turns_of_the_principal_solutions(q: Array) -> None:
    assume(np.linalg.svd(jacobian(q), compute_uv=False)[-1] > 1e-6)
    T = forward(q)
    principal = {str(branch.label): branch.q for branch in IK.branches(T)}
    assert all((np.abs(branch) <= np.pi).all() for branch in principal.values())
    solutions = IK.solve(T)
    for solution in solutions:
        turns = (solution.q - principal[str(solution.label)]) / (2 * np.pi)
        assert np.abs(turns - turns.round()).max() < ROUNDING
    nearest = IK.solve(T, windings=False)
    assert len(nearest) == len({str(solution.label) for solution in solutions})
    for solution in nearest:
        peers = joints([other for other in solutions if other.label == solution.label])
        assert (np.abs(solution.q) <= np.abs(peers).min(axis=0) + ROUNDING).all()


def test_each_joint_of_two_turns_doubles_the_answers() -> None:
    solutions = IK.solve(forward(EVERYDAY))
    branches = {str(solution.label) for solution in solutions}
    # The elbow has one turn, the other five joints two.
    assert len(solutions) == len(branches) * 2**5


def test_a_configuration_on_its_limits_is_found_inside_them() -> None:
    q = EVERYDAY.copy()
    q[0], q[5] = LIMITS.q_max[0], LIMITS.q_min[5]
    found = joints(IK.solve(forward(q)))
    assert np.abs(found - q).max(axis=1).min() < FOUND
    assert (found >= LIMITS.q_min).all()
    assert (found <= LIMITS.q_max).all()


def test_tightened_limits_leave_what_is_inside() -> None:
    T = forward(EVERYDAY)
    tight = replace(LIMITS, q_min=EVERYDAY - 0.1, q_max=EVERYDAY + 0.1)
    (only,) = IK.solve(T, limits=tight)
    assert only.q == pytest.approx(EVERYDAY, abs=FOUND)
    assert only.limit_distance == pytest.approx(0.1, abs=FOUND)


def test_a_rotation_rounded_to_nine_digits_is_met_to_as_many() -> None:
    T = forward(EVERYDAY)
    T[:3, :3] += np.random.default_rng(4).uniform(-3e-10, 3e-10, (3, 3))
    solutions = IK.solve(T)
    assert len({str(solution.label) for solution in solutions}) == 8
    assert all(max(errors(T, solution.q)) < ACCURACY for solution in solutions)


def test_is_built_once() -> None:
    assert inverse_kinematics_for(ROBOT) is required_inverse_kinematics(ROBOT, "goal")


def test_answers_are_ordered_by_branch() -> None:
    labels = [solution.label for solution in IK.solve(forward(EVERYDAY))]
    assert sum(a != b for a, b in pairwise(labels)) == len(set(labels)) - 1
