"""Self-motions of seven-joint arms with a spherical shoulder, against Pinocchio and Newton's
method.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Robot, UnreachablePose, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.seven.redundant_arm import RedundantArm
from joulepath.optimizer.kinematics.seven.redundant_curve import RedundantCurve
from tests.optimizer.chains import serial_chain
from tests.optimizer.kinematics.seven_joints import (
    ACCURACY,
    FOUND,
    ROBOTS,
    away,
    closed_form,
    configurations,
    flange,
)
from tests.selection import long_but

# largest distance from the curve for results of Newton's method with a tolerance of 1e-11 [rad]
FOUND_BY_NEWTON = 1e-5
# largest distance of an approximately nearest member, relative to the nearest one
ROUGHLY = 1.5
# largest distance of an arc beyond the limits, equal to the last undecided box [rad]
BEYOND = 0.15
# relative accuracy of a distance to reach
SAME = 1e-6
# configurations [rad] of an iiwa14 on curves with shared ends and a middle outside the limits:
# tests of ends and middle alone miss these curves
OUTSIDE_IN_THE_MIDDLE = (
    [
        0.622008753913,
        1.773831814219,
        2.365978576939,
        -0.918253011653,
        -1.213216563581,
        -1.805610968930,
        0.170567686219,
    ],
    [
        -2.693120771898,
        -0.108022916652,
        -1.495926897457,
        1.636634698177,
        0.140531116865,
        -0.559247289051,
        -1.294109628827,
    ],
)


@pytest.fixture(params=ROBOTS, scope="module")
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


@pytest.fixture(scope="module")
def arm(robot: Robot) -> RedundantArm:
    return closed_form(robot)


def parameters(curve: RedundantCurve, count: int, rng: np.random.Generator) -> Array:
    return np.concatenate([rng.uniform(lower, upper, count) for lower, upper in curve.arcs])


@pytest.mark.parametrize("count", long_but((30,), (30, 1_000)))
def test_every_configuration_is_on_a_curve_of_its_pose(
    robot: Robot, arm: RedundantArm, count: int
) -> None:
    for q in configurations(robot, count):
        curves = arm.self_motions(flange(robot, q), robot.limits)
        assert away(curves, q) < FOUND
        nearest = min(curves, key=lambda each: away([each], q))
        assert nearest.label == arm.label(q)


def test_every_member_reaches_the_pose(robot: Robot, arm: RedundantArm) -> None:
    rng = np.random.default_rng(42)
    for q in configurations(robot, 20):
        T = flange(robot, q)
        for curve in arm.self_motions(T):
            for member in curve.at(parameters(curve, 6, rng)):
                assert np.abs(flange(robot, member) - T).max() < ACCURACY


def newton(robot: Robot, T: Array, q: Array) -> Array | None:
    """Configuration at T by damped Newton steps from q with Pinocchio's Jacobian, or None."""
    model, data = robot.model, robot.model.createData()
    frame, goal = model.getFrameId("flange"), pin.SE3(T)
    for _ in range(60):
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        J = pin.getFrameJacobian(model, data, frame, pin.LOCAL)
        error = pin.log6(data.oMf[frame].actInv(goal)).vector
        if np.abs(error).max() < 1e-11:
            return np.asarray(q)
        step = J.T @ np.linalg.solve(
            J @ J.T + 1e-6 * min(1.0, float(error @ error)) * np.eye(6), error
        )
        q = q + step * min(1.0, 0.5 / float(np.abs(step).max()))
    return None


def test_solutions_of_newtons_method_are_on_a_curve(robot: Robot, arm: RedundantArm) -> None:
    """All solutions of Newton's method, from random starts and without limits, are on a curve."""
    rng, found = np.random.default_rng(43), 0
    for q in configurations(robot, 5):
        T = flange(robot, q)
        curves = arm.self_motions(T)
        for seed in rng.uniform(-np.pi, np.pi, (12, 7)):
            other = newton(robot, T, seed)
            if other is not None:
                found += 1
                assert away(curves, other) < FOUND_BY_NEWTON
    assert found > 20


def test_the_nearest_member_is_found_for_configurations_off_the_curve(
    robot: Robot, arm: RedundantArm
) -> None:
    """This includes points with two branches meeting, without guidance from the last angle."""
    rng = np.random.default_rng(47)
    for q in configurations(robot, 6):
        for curve in arm.self_motions(flange(robot, q), robot.limits):
            lower = curve.arcs[0][0]
            beside = curve.at(np.array([lower]))[0] + rng.normal(scale=0.1, size=7)
            members = curve.at(np.concatenate([np.linspace(*arc, 2000) for arc in curve.arcs]))
            least = np.abs(wrapped(members - beside)).max(axis=1).min()
            assert away([curve], beside) < ROUGHLY * least


def test_boxes_hold_the_curve(robot: Robot, arm: RedundantArm) -> None:
    rng = np.random.default_rng(44)
    for q in configurations(robot, 12):
        for curve in arm.self_motions(flange(robot, q), robot.limits):
            middle = parameters(curve, 3, rng)
            half = rng.uniform(0.0, 0.5, len(middle)) ** 2
            centre, sides = curve.boxes(middle, half)
            for k in range(len(middle)):
                near = middle[k] + half[k] * np.linspace(-1, 1, 15)
                members = curve.at(near if curve.whole else np.clip(near, 0.0, np.pi))
                assert (np.abs(wrapped(members - centre[k])) <= sides[k]).all()


def test_boxes_shrink_onto_the_curve(robot: Robot, arm: RedundantArm) -> None:
    """Boxes are of first order, except for fast joints near a singularity."""
    rng, width = np.random.default_rng(45), []
    for q in configurations(robot, 20):
        for curve in arm.self_motions(flange(robot, q), robot.limits):
            middle = parameters(curve, 4, rng)
            width += curve.boxes(middle, np.full(len(middle), 1e-3))[1].max(axis=1).tolist()
    assert np.median(width) < 0.05


def test_arcs_are_the_parts_within_the_limits(robot: Robot, arm: RedundantArm) -> None:
    """Arcs contain all members within the limits, and no others except near their ends."""
    limits, rng = robot.limits, np.random.default_rng(46)
    cut, outside = 0, []
    for q in configurations(robot, 20):
        T = flange(robot, q)
        kept = [each for each in arm.self_motions(T, limits) if isinstance(each, RedundantCurve)]
        for curve in (each for each in arm.self_motions(T) if isinstance(each, RedundantCurve)):
            arcs = [
                arc
                for each in kept
                if (each.signs == curve.signs).all()
                for arc in each.arcs
                if each.interval == curve.interval
            ]
            for u, member in zip(at := parameters(curve, 60, rng), curve.at(at), strict=True):
                middle = (limits.q_min + limits.q_max) / 2
                beyond = float(
                    (np.abs(wrapped(member - middle)) - (limits.q_max - limits.q_min) / 2).max()
                )
                on_arc = any(lower <= u <= upper for lower, upper in arcs)
                cut += not on_arc
                assert on_arc or beyond > 0
                if on_arc and beyond > 0:
                    outside.append(beyond)
    assert cut > 100
    # Next to a singularity a box is wide, and its members are tested one by one.
    assert np.quantile([*outside, 0.0], 0.5) < BEYOND


def test_a_curve_with_a_short_part_within_the_limits_gives_a_member() -> None:
    """A curve has a member even if only a short part in the middle of an arc is within limits.

    The last joint is on its limit.
    """
    panda = load_robot("panda")
    q = np.array(
        [
            2.7836954234526634,
            0.054726722201069,
            0.12264925125535742,
            -0.38038534780456557,
            1.4067400815888678,
            2.171561296725141,
            2.8973,
        ]
    )
    curves = [
        each.self_motion
        for each in required_inverse_kinematics(panda, "goal").solve(flange(panda, q))
    ]
    nearest = [each.at(np.array([each.parameter(q)]))[0] for each in curves if each is not None]
    assert np.abs(wrapped(np.array(nearest) - q)).max(axis=1).min() < FOUND


def test_poses_out_of_reach_say_by_how_much(robot: Robot) -> None:
    """No pose closer than the reported distance, in any direction, is in reach."""
    inverse = required_inverse_kinematics(robot, "goal")
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 2.0]
    with pytest.raises(UnreachablePose) as refusal:
        inverse.solve(T)
    distance = refusal.value.distance
    assert distance is not None
    # With the tool along z, an arm without a wrist offset is highest when stretched.
    stretched = {"iiwa14": 0.36 + 0.42 + 0.4 + 0.126, "panda": None, "xarm7": None}[robot.name]
    if stretched is not None:
        assert distance == pytest.approx(2.0 - stretched, rel=SAME)
    T[2, 3] = 2.0 - 1.001 * distance
    shifted = [T.copy() for _ in range(400)]
    rng = np.random.default_rng(50)
    for each in shifted:
        direction = rng.normal(size=3)
        each[:3, 3] = [0.0, 0.0, 2.0] + 0.999 * distance * direction / np.linalg.norm(direction)
    assert not any(inverse.branches(each) for each in shifted)


def test_arms_of_another_form_have_none() -> None:
    assert RedundantArm.of(serial_chain(7).model) is None
    robot = load_robot("panda")
    for joint in (2, 3, 6):
        model = robot.model.copy()
        model.jointPlacements[joint].translation += np.array([1e-4, 2e-4, 3e-4])
        assert RedundantArm.of(model) is None


@pytest.mark.parametrize("configuration", OUTSIDE_IN_THE_MIDDLE)
def test_a_curve_that_is_outside_the_limits_in_the_middle_is_answered(
    configuration: list[float],
) -> None:
    robot, q = load_robot("iiwa14"), np.array(configuration)
    answers = required_inverse_kinematics(robot, "goal").solve(flange(robot, q))
    curves = list(dict.fromkeys(each.self_motion for each in answers))
    assert away(curves, q) < FOUND  # type: ignore[arg-type]
    assert all(
        robot.limits.q_min[j] <= each.q[j] <= robot.limits.q_max[j]
        for each in answers
        for j in range(7)
    )
