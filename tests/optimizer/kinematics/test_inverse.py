"""Inverse kinematics against Pinocchio's forward kinematics, and against solvers that know nothing of branches."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from models.registry import load_robot
from models.robot import Array
from optimizer.exceptions import InvalidProblem, SingularPose, UnreachablePose
from optimizer.kinematics.inverse import SINGULAR, IKSolution, inverse_kinematics_for, required_inverse_kinematics

ROBOT = load_robot("ur5e")
IK = inverse_kinematics_for(ROBOT)
MODEL, DATA = ROBOT.model, ROBOT.model.createData()
FLANGE = MODEL.getFrameId("flange")
LIMITS = ROBOT.limits

# what the product promises of an answer's forward kinematics [m, rad] and of a configuration found again [rad]
ACCURACY = 1e-9
FOUND = 1e-6
# of double precision, and of the part of an angle that a limit may cut off an answer on it [m, turns]
ROUNDING = 1e-10
# the search that judges the distance to reach converges to this [m]
SEARCH = 1e-5

EVERYDAY = np.array([0.3, -1.6, 1.9, -1.8, -1.5, 0.2])
angles = st.lists(st.floats(-2 * np.pi, 2 * np.pi), min_size=6, max_size=6).map(np.array)


def forward(q: Array) -> Array:
    pin.framesForwardKinematics(MODEL, DATA, q)
    return np.array(DATA.oMf[FLANGE].homogeneous)


def jacobian(q: Array) -> Array:
    return np.array(pin.computeFrameJacobian(MODEL, DATA, q, FLANGE, pin.LOCAL_WORLD_ALIGNED))


def errors(T: Array, q: Array) -> tuple[float, float]:
    """Position [m] and rotation [rad] of the flange at q against T."""
    reached = forward(q)
    turn = np.linalg.norm(reached[:3, :3] - T[:3, :3]) / np.sqrt(2)
    return float(np.linalg.norm(reached[:3, 3] - T[:3, 3])), float(turn)


def joints(solutions: list[IKSolution]) -> Array:
    return np.array([solution.q for solution in solutions])


def pose(position: list[float], rotation: Array | None = None) -> Array:
    T = np.eye(4)
    T[:3, 3] = position
    T[:3, :3] = np.eye(3) if rotation is None else rotation
    return T


def test_ten_thousand_configurations_inside_the_limits() -> None:
    rng = np.random.default_rng(20240501)
    for q in rng.uniform(LIMITS.q_min, LIMITS.q_max, (10_000, 6)):
        T = forward(q)
        solutions = IK.solve(T)
        found = joints(solutions)
        distance = np.abs(found - q).max(axis=1)
        assert distance.min() < FOUND
        assert solutions[int(distance.argmin())].label == IK.label(q)
        assert (found >= LIMITS.q_min).all()
        assert (found <= LIMITS.q_max).all()

        # answers of one label are one configuration and its full turns, no two of them the same ...
        first = {solution.label: solution for solution in reversed(solutions)}
        turns = (found - np.array([first[solution.label].q for solution in solutions])) / (2 * np.pi)
        assert np.abs(turns - turns.round()).max() < ROUNDING
        keys = np.column_stack([[list(first).index(solution.label) for solution in solutions], turns.round()])
        assert len(np.unique(keys, axis=0)) == len(solutions)
        # ... and those of two labels are different configurations, each of which reaches the pose
        branches = joints(list(first.values()))
        apart = np.abs(np.exp(1j * branches[:, None]) - np.exp(1j * branches[None])).max(axis=2)
        assert (apart + np.eye(len(branches))).min() > FOUND
        for branch in first.values():
            assert max(errors(T, branch.q)) < ACCURACY


def test_near_singular_configurations_are_found_to_the_same_accuracy() -> None:
    rng = np.random.default_rng(7)
    for _ in range(500):
        q = rng.uniform(LIMITS.q_min, LIMITS.q_max)
        q[rng.choice([2, 4])] = rng.choice([-1, 1]) * 10 ** rng.uniform(-6, -2)
        # two singularities at once multiply: leave those to the test of singular poses
        if np.linalg.svd(jacobian(q), compute_uv=False)[-1] < 2 * SINGULAR:
            continue
        assert np.abs(joints(IK.solve(forward(q))) - q).max(axis=1).min() < FOUND


def test_reports_singular_value_and_limit_distance() -> None:
    for solution in IK.solve(forward(EVERYDAY)):
        assert solution.smallest_singular_value == pytest.approx(
            np.linalg.svd(jacobian(solution.q), compute_uv=False)[-1], abs=1e-12
        )
        assert solution.limit_distance == min((solution.q - LIMITS.q_min).min(), (LIMITS.q_max - solution.q).min())


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
                q = q + np.clip(local.T @ np.linalg.solve(local @ local.T + 1e-9 * np.eye(6), step), -0.5, 0.5)
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


def test_everyday_posture_has_the_everyday_label() -> None:
    assert str(IK.label(EVERYDAY)) == "left/up/no_flip"


def test_labels_say_where_the_elbow_and_the_arm_are() -> None:
    """Of arms that reach well ahead: the elbow's height and the side of the offset, from frames alone."""
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


@given(q=angles, direction=st.lists(st.floats(-1, 1), min_size=6, max_size=6).map(np.array))
@settings(max_examples=50, deadline=None)
def test_label_is_constant_along_a_branch(q: Array, direction: Array) -> None:
    """Along a path without a singularity the solution next to the last one has its label."""
    path = q + np.linspace(0, 1, 60)[:, None] * direction
    volume = np.array([np.linalg.det(jacobian(point)) for point in path])
    assume(abs(volume).min() > 1e-5 and (np.sign(volume) == np.sign(volume[0])).all())
    branches = [IK.branches(forward(point)) for point in path]
    for last, now, point in zip(branches, branches[1:], path[1:], strict=False):
        assert IK.label(point) == IK.label(path[0])
        for solution in last:
            if solution.smallest_singular_value < 0.01:
                continue
            gaps = [np.abs(np.exp(1j * other.q) - np.exp(1j * solution.q)).max() for other in now]
            # a nearby one that is another branch would have to cross a singularity within a step of 1/60 rad
            if min(gaps) < 0.05:
                assert now[int(np.argmin(gaps))].label == solution.label


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
    # the elbow has one turn, the other five joints two
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


def test_nothing_inside_the_limits_says_so() -> None:
    tight = replace(LIMITS, q_min=EVERYDAY + 0.1, q_max=EVERYDAY + 0.2)
    with pytest.raises(UnreachablePose, match=r"start .*position limit") as caught:
        IK.solve(forward(EVERYDAY), limits=tight, target="start")
    assert caught.value.target == "start"
    assert caught.value.distance is None


@pytest.mark.parametrize(
    "T",
    [
        pose([3.0, 0.0, 0.2]),
        pose([0.2, -0.9, 0.9], pin.rpy.rpyToMatrix(0.4, 1.9, -0.7)),
        pose([0.0, 0.0, 0.6], pin.rpy.rpyToMatrix(np.pi, 0.0, 0.3)),
        pose([0.05, 0.02, 0.5], pin.rpy.rpyToMatrix(0.1, 0.0, 0.3)),
    ],
    ids=["far", "just out of reach", "on the first axis", "inside the shoulder's cylinder"],
)
def test_distance_is_to_the_nearest_reachable_position(T: Array) -> None:
    with pytest.raises(UnreachablePose, match="out of reach") as caught:
        IK.solve(T)
    distance = caught.value.distance
    assert distance is not None
    assert distance == pytest.approx(nearest_by_search(T), abs=SEARCH)


def test_distance_from_the_first_axis_is_the_shoulders_offset() -> None:
    with pytest.raises(UnreachablePose) as caught:
        IK.solve(pose([0.0, 0.0, 0.6], pin.rpy.rpyToMatrix(np.pi, 0.0, 0.3)))
    assert caught.value.distance == pytest.approx(0.1333, abs=ROUNDING)


def nearest_by_search(T: Array) -> float:
    """Least distance from T's position among configurations with T's orientation, from many random starts."""

    def turn(q: Array) -> Array:
        return np.asarray(pin.log3(T[:3, :3].T @ forward(q)[:3, :3]))

    def turn_gradient(q: Array) -> Array:
        R = T[:3, :3].T @ forward(q)[:3, :3]
        return np.asarray(pin.Jlog3(R) @ pin.computeFrameJacobian(MODEL, DATA, q, FLANGE, pin.LOCAL)[3:])

    def square(q: Array) -> tuple[float, Array]:
        gap = forward(q)[:3, 3] - T[:3, 3]
        return float(gap @ gap), 2 * jacobian(q)[:3].T @ gap

    found = []
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (25, 6)):
        answer = minimize(
            square, q, jac=True, method="SLSQP", constraints={"type": "eq", "fun": turn, "jac": turn_gradient},
            options={"maxiter": 200, "ftol": 1e-14},
        )  # fmt: skip
        if np.linalg.norm(turn(answer.x)) < 1e-7:
            found.append(np.sqrt(answer.fun))
    return float(min(found))


@pytest.mark.parametrize(
    "q",
    [
        np.array([0.4, -0.7, 0.0, 0.5, 1.0, 0.3]),
        np.array([0.4, -1.3, 1.5, 0.5, 0.0, 0.3]),
        np.array([0.4, -1.3, 1.5, 0.5, np.pi, 0.3]),
    ],
    ids=["stretched elbow", "stretched wrist", "folded wrist"],
)
def test_singular_solutions_are_left_out_where_there_are_others(q: Array) -> None:
    T = forward(q)
    assert any(branch.smallest_singular_value < SINGULAR for branch in IK.branches(T))
    solutions = IK.solve(T)
    for solution in solutions:
        assert solution.smallest_singular_value >= SINGULAR
        assert max(errors(T, solution.q)) < ACCURACY


def test_rounding_does_not_hide_a_singularity() -> None:
    """A stretched elbow, and a tool's transform there and back, which moves the pose by its last digit."""
    rng = np.random.default_rng(5)
    for q in rng.uniform(-np.pi, np.pi, (300, 6)):
        q[2] = 0.0
        tool = pose([0.1, -0.2, 0.3], pin.rpy.rpyToMatrix(*rng.uniform(-1, 1, 3)))
        try:
            solutions = IK.solve(forward(q) @ tool, tool)
        except SingularPose:
            continue
        assert np.abs(np.exp(1j * joints(solutions)) - np.exp(1j * q)).max(axis=1).min() > FOUND


def test_upright_home_is_singular() -> None:
    home = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
    with pytest.raises(SingularPose) as caught:
        IK.solve(forward(home), target="start")
    assert caught.value.target == "start"
    assert caught.value.smallest_singular_value < SINGULAR


def test_only_singular_solutions_inside_the_limits_are_no_answer() -> None:
    q = np.array([0.4, -0.7, 0.0, 0.5, 1.0, 0.3])
    tight = replace(LIMITS, q_min=q - 0.1, q_max=q + 0.1)
    with pytest.raises(SingularPose) as caught:
        IK.solve(forward(q), limits=tight)
    assert caught.value.smallest_singular_value < SINGULAR


@pytest.mark.parametrize("far", [1e3, 1e9, 1e160, 1e300])
def test_any_finite_pose_is_answered(far: float) -> None:
    with pytest.raises(UnreachablePose) as caught:
        IK.solve(pose([far, -far, far]))
    assert caught.value.distance == pytest.approx(np.sqrt(3) * far, rel=1e-2)


def test_a_pose_that_only_a_continuum_reaches_is_singular() -> None:
    """A stretched wrist at every split of its turn between the fourth and sixth joint, never out of reach."""
    rng = np.random.default_rng(2)
    seen = 0
    for _ in range(300):
        q = np.array([rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-0.2, 0.2), *rng.uniform(-3, 3, 3)])
        q[4] = rng.choice([0.0, np.pi])
        try:
            IK.solve(forward(q))
        except SingularPose:
            seen += 1
    assert seen > 10


def test_a_pose_within_rounding_of_the_edge_of_reach_is_singular() -> None:
    stretched = forward(np.array([0.4, -0.7, 0.0, 0.5, 1.0, 0.3]))
    for shift in (-1e-14, 1e-14):
        T = stretched.copy()
        T[:3, 3] *= 1 + shift
        try:
            solutions = IK.solve(T)
        except SingularPose:
            continue
        assert all(solution.smallest_singular_value >= SINGULAR for solution in solutions)


def test_a_rotation_rounded_to_nine_digits_is_met_to_as_many() -> None:
    T = forward(EVERYDAY)
    T[:3, :3] += np.random.default_rng(4).uniform(-3e-10, 3e-10, (3, 3))
    solutions = IK.solve(T)
    assert len({str(solution.label) for solution in solutions}) == 8
    assert all(max(errors(T, solution.q)) < ACCURACY for solution in solutions)


def test_another_kind_of_arm_is_refused() -> None:
    other = ROBOT.model.copy()
    placement = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.2, 0.0), np.array([0.1, 0.0, 0.0]))
    other.jointPlacements[3] = other.jointPlacements[3] * placement
    robot = replace(ROBOT, model=other)
    assert inverse_kinematics_for(robot) is None
    with pytest.raises(InvalidProblem, match="give joint positions") as refusal:
        required_inverse_kinematics(robot, "goal.any_of.0.pose")
    assert refusal.value.field == "goal.any_of.0.pose"


def test_is_built_once() -> None:
    assert inverse_kinematics_for(ROBOT) is IK is required_inverse_kinematics(ROBOT, "goal")


def test_answers_are_ordered_by_branch() -> None:
    labels = [solution.label for solution in IK.solve(forward(EVERYDAY))]
    assert sum(a != b for a, b in pairwise(labels)) == len(set(labels)) - 1
