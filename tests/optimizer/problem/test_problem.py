"""Values accepted by a problem and by a branch filter; refusals name the field by contract."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    AnyOf,
    Arm,
    InvalidProblem,
    OutsideLimits,
    Payload,
    Pose,
    Problem,
    inverse_kinematics,
    load_robot,
)
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tcp import tcp_pose as forward
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.branches import BranchFilter, Label
from joulepath.optimizer.search.ends import ends
from tests.optimizer.moves import GOAL, ROBOT, START, limits, problem, tcp_pose
from tests.refusals import refusal_of

ROTATED = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.4, 2.0), np.array([0.4, 0.1, 0.5])).homogeneous


def outside(joint: int, by: float) -> Array:
    q: Array = GOAL.copy()
    q[joint] = ROBOT.limits.q_max[joint] + by
    return q


def test_defaults() -> None:
    """An arm without a load, upright; electrical energy, free duration."""
    task = Problem(arm=Arm(robot=ROBOT), start=START, goal=GOAL)
    assert task.arm.robot.name == "ur5e" and task.arm.payload.mass == 0
    assert task.arm.gravity.tolist() == [0, 0, -9.81]
    assert (task.method, task.objective, task.duration_min, task.duration_max) == (
        "bspline",
        "electrical",
        None,
        None,
    )
    assert task.arm.active_limits is ROBOT.limits and task.arm.friction_law is ROBOT.friction
    assert (task.windings, task.branch, task.sample_period, task.deadline) == (
        True,
        None,
        0.008,
        10.0,
    )
    assert (task.arm.T_flange_tcp == np.eye(4)).all()


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"start": np.zeros(5)}, "start.q"),
        ({"goal": np.zeros((6, 1))}, "goal.q"),
        ({"goal": [0, 0, 0, 0, 0, math.nan]}, "goal.q"),
        ({"start": ["a"] * 6}, "start.q"),
        ({"gravity": [0, 0]}, "gravity"),
        ({"gravity": [0, 0, math.inf]}, "gravity"),
        ({"T_flange_tcp": np.diag([1.0, 1.0, -1.0, 1.0])}, "tcp"),
        ({"duration_min": 0.0}, "duration"),
        ({"duration_max": -1.0}, "duration"),
        ({"duration_max": math.nan}, "duration"),
        ({"duration_max": math.inf}, "duration"),
        ({"duration_max": 601.0}, "duration"),
        ({"duration_min": 2.0, "duration_max": 1.0}, "duration"),
        ({"objective": "mechanical"}, "duration"),
        ({"objective": "mechanical", "duration_min": 1.0}, "duration"),
        ({"sample_period": 0.0}, "sample_period"),
        ({"sample_period": math.nan}, "sample_period"),
        ({"deadline": -1.0}, "deadline"),
        ({"friction": "none such"}, "friction"),
        ({"limits": limits(v_max=0.0)}, "limits.velocity"),
        ({"limits": limits(v_max=[1, 1, 1, 1, 1, 4])}, "limits.velocity"),
        ({"limits": limits(a_max=-1.0)}, "limits.acceleration"),
        ({"limits": limits(a_max=10.1)}, "limits.acceleration"),
        ({"limits": limits(j_max=1e6)}, "limits.jerk"),
        ({"limits": limits(tau_max=150.0)}, "limits.torque"),
        ({"limits": limits(q_min=-7.0)}, "limits.position"),
        ({"limits": limits(q_max=7.0)}, "limits.position"),
        ({"limits": limits(q_min=1.0, q_max=1.0)}, "limits.position"),
    ],
    ids=str,
)
def test_refusals_name_the_field(given: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        problem(**given)
    assert refusal.value.field == field
    assert str(refusal.value).endswith(".") and "\n" not in str(refusal.value)


@pytest.mark.parametrize("width", [1e-3, 1e-6])
@pytest.mark.parametrize("name", ["panda", "gen3", "iiwa14", "ur5e"])
def test_a_pose_is_in_reach_with_a_joint_held_in_a_narrow_range(name: str, width: float) -> None:
    """A configuration within the range is found for every joint, on a curve of a redundant arm
    that crosses the range within a small part of its length.
    """
    robot, rng = load_robot(name), np.random.default_rng(3)
    limits = robot.limits
    low, high = np.maximum(limits.q_min, -3), np.minimum(limits.q_max, 3)
    for joint in range(robot.nq):
        q = rng.uniform(low + width, high - width)
        half = np.where(np.arange(robot.nq) == joint, width / 2, np.inf)
        centre = q + width * rng.uniform(-0.45, 0.45, robot.nq)
        within = np.maximum(limits.q_min, centre - half), np.minimum(limits.q_max, centre + half)
        tight = limits.tightened(q_min=within[0], q_max=within[1])
        arm = Arm(robot=robot, limits=tight, collisions=False)
        found = inverse_kinematics(arm, Pose(forward(arm, q)), windings=False)
        assert len(found)
        assert all((within[0] <= each.q).all() and (each.q <= within[1]).all() for each in found)


@pytest.mark.parametrize(
    ("given", "target"),
    [({"goal": outside(2, 2e-4)}, "goal"), ({"start": -outside(5, 2e-4)}, "start")],
)
def test_joint_positions_outside_their_range_name_the_target(
    given: dict[str, Any], target: str
) -> None:
    with pytest.raises(OutsideLimits) as refusal:
        problem(**given)
    assert refusal.value.target == target


@pytest.mark.parametrize("name", ["v_max", "a_max", "j_max", "tau_max", "q_min", "q_max"])
def test_nan_is_no_limit(name: str) -> None:
    """NaN compares false with everything, so a check for too large limits would accept it."""
    values = getattr(ROBOT.limits, name).copy()
    values[3] = math.nan
    with pytest.raises(InvalidProblem):
        problem(limits=replace(ROBOT.limits, **{name: values}))


@pytest.mark.parametrize("name", ["v_max", "a_max", "tau_max"])
def test_a_robot_without_a_limit_is_refused(name: str) -> None:
    """Bounds divide one limit by another. Jerk needs none."""
    without = replace(ROBOT.limits, **{name: np.full(6, math.inf)})
    with pytest.raises(InvalidProblem, match="finite"):
        problem(robot=replace(ROBOT, limits=without))


@pytest.mark.parametrize("name", ["v_max", "a_max", "j_max", "tau_max", "q_min", "q_max"])
def test_limits_are_one_per_joint(name: str) -> None:
    with pytest.raises(InvalidProblem):
        problem(limits=replace(ROBOT.limits, **{name: getattr(ROBOT.limits, name)[:1]}))


def test_a_joint_outside_carries_its_data() -> None:
    with pytest.raises(OutsideLimits) as refusal:
        problem(start=outside(2, 0.25))
    error = refusal.value
    assert (error.target, error.joint) == ("start", ROBOT.joint_names[2])
    assert (error.value, error.lower, error.upper) == pytest.approx(
        (math.pi + 0.25, -math.pi, math.pi)
    )


def test_tightened_limits_count_for_the_ends() -> None:
    assert problem(limits=limits(q_max=1.65)).arm.active_limits.q_max[0] == 1.65
    with pytest.raises(OutsideLimits) as refusal:
        problem(limits=limits(q_max=1.55))
    assert (refusal.value.target, refusal.value.joint) == ("start", ROBOT.joint_names[2])


def test_limits_may_be_the_robots_own_and_the_ends_on_them() -> None:
    at_limit = np.where(np.arange(6) % 2 == 0, ROBOT.limits.q_max, ROBOT.limits.q_min)
    task = problem(goal=at_limit, limits=limits(v_max=ROBOT.limits.v_max * (1 + 1e-10)))
    assert (np.asarray(task.goal) == at_limit).all()


def test_a_limit_that_a_refusal_names_is_accepted() -> None:
    """Two thirds of pi rad/s round to 2.09440, which is above the limit."""
    robot = load_robot("ur10e")
    wide = replace(robot.limits, v_max=np.full(6, 3.0))
    with pytest.raises(InvalidProblem) as refusal:
        Arm(robot=robot, limits=wide)
    named = float(str(refusal.value).rstrip(".").split()[-1])
    assert named == pytest.approx(robot.limits.v_max.min(), rel=1e-5)
    Arm(robot=robot, limits=replace(wide, v_max=np.full(6, named)))


def test_positions_at_a_printed_limit_are_at_the_limit() -> None:
    """Limits of the robot are printed with few digits: 6.28319 for a full turn."""
    at = outside(2, 9e-5)
    task = problem(goal=at, start=AnyOf([at, START]))
    assert np.asarray(task.goal)[2] == ROBOT.limits.q_max[2]
    (found, *_), unreachable = ends(PreparedProblem.of(task), "start")
    assert found.q[2] == ROBOT.limits.q_max[2] and not unreachable


def test_a_mechanical_objective_wants_an_upper_bound_only() -> None:
    assert problem(objective="mechanical", duration_max=2.0).duration_min is None


def test_targets_may_be_lists_poses_and_mixed() -> None:
    assert np.asarray(problem(start=START.tolist()).start).tolist() == START.tolist()
    task = problem(start=tcp_pose(START), goal=GOAL)
    assert isinstance(task.start, Pose) and not isinstance(task.goal, Pose)


def test_nothing_can_be_changed_afterwards() -> None:
    """Fields and their arrays are constant, and the caller's own arrays stay writable."""
    start = START.copy()
    task = problem(start=start)
    start[0] = 9.0
    assert np.asarray(task.start)[0] == START[0]
    with pytest.raises(FrozenInstanceError):
        task.deadline = 1.0  # type: ignore[misc]
    for array in (
        task.start,
        task.arm.gravity,
        task.arm.T_flange_tcp,
        task.arm.payload.com,
        Pose(ROTATED).T,
    ):
        assert isinstance(array, np.ndarray)
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize(
    "T",
    [
        np.eye(3),
        np.where(np.eye(4) == 1, 1.001, 0.0),  # scaled
        np.diag([1.0, 1.0, -1.0, 1.0]),  # mirrored
        ROTATED + 1e-6 * np.eye(4)[:, ::-1],  # sheared
        np.full((4, 4), math.nan),
        ROTATED[:, ::-1],
        "pose",
    ],
    ids=["shape", "scaled", "mirrored", "sheared", "nan", "shuffled", "text"],
)
def test_a_pose_must_be_rigid(T: Array) -> None:
    with refusal_of("pose"):
        Pose(T)


def test_a_pose_must_be_homogeneous() -> None:
    """The last row of a homogeneous matrix is 0 0 0 1: a matrix transposed by mistake has its
    position there.
    """
    broken = ROTATED.copy()
    broken[3, :3], broken[:3, 3] = broken[:3, 3].copy(), 0.0
    with pytest.raises(InvalidProblem):
        Pose(broken)


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"mass": -1.0}, "payload.mass"),
        ({"mass": math.nan}, "payload.mass"),
        ({"mass": 1.0, "com": [0, 0]}, "payload.com"),
        ({"mass": 1.0, "com": [0, 0, math.inf]}, "payload.com"),
        ({"mass": 1.0, "inertia": np.eye(2)}, "payload.inertia"),
        ({"mass": 1.0, "inertia": np.diag([1.0, 1.0, -1e-3])}, "payload.inertia"),
        ({"mass": 1.0, "inertia": np.diag([1.0, 1.0, 2.001])}, "payload.inertia"),
        (
            {"mass": 1.0, "inertia": np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]])},
            "payload.inertia",
        ),
    ],
    ids=str,
)
def test_a_payload_must_be_a_body(given: dict[str, Any], field: str) -> None:
    """Positive mass, a symmetric inertia tensor, and principal moments of a possible mass
    distribution.
    """
    with refusal_of(field):
        Payload(**given)


def test_bodies_on_the_border_are_bodies() -> None:
    """A point has no inertia, and of a flat disc one principal moment is the sum of the others."""
    Payload(mass=3.0)
    Payload(mass=1.0, inertia=np.diag([0.01, 0.01, 0.02]))
    Payload(mass=0.0)


LABELS = [
    Label("left", "up", "flip"),
    Label("left", "up", "no_flip"),
    Label("left", "down", "flip"),
    Label("left", "down", "no_flip"),
    Label("right", "up", "flip"),
    Label("right", "up", "no_flip"),
    Label("right", "down", "flip"),
    Label("right", "down", "no_flip"),
]


@dataclass(frozen=True)
class ElbowOnly:
    """Branch labels of an arm whose solutions differ in the elbow alone."""

    elbow: str


def test_an_empty_filter_allows_every_label() -> None:
    assert all(
        BranchFilter().allows(label) for label in [*LABELS, ElbowOnly("up"), "another family's"]
    )


def test_each_part_that_is_named_halves_the_labels() -> None:
    assert sum(BranchFilter(elbow="up").allows(label) for label in LABELS) == 4
    assert sum(BranchFilter(elbow="up", wrist="flip").allows(label) for label in LABELS) == 2
    assert [label for label in LABELS if BranchFilter("left", "down", "no_flip").allows(label)] == [
        Label("left", "down", "no_flip")
    ]


def test_a_filter_assumes_only_the_parts_that_it_names() -> None:
    assert BranchFilter(elbow="up").allows(ElbowOnly("up"))
    assert not BranchFilter(elbow="down").allows(ElbowOnly("up"))
    # an arm without a shoulder part cannot be on the left
    assert not BranchFilter(shoulder="left").allows(ElbowOnly("up"))
