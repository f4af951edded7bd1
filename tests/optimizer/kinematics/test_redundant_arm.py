"""Arms of seven joints with a spherical shoulder: curves of configurations, against Pinocchio and
Newton's method.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import UnreachablePose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.seven.free_turn import SETTINGS, FreeTurn
from joulepath.optimizer.kinematics.seven.redundant_arm import RedundantArm
from joulepath.optimizer.kinematics.seven.redundant_curve import RedundantCurve
from tests.optimizer.chains import serial_chain
from tests.selection import long_but

# m and rad: what a member may miss its pose by, and a configuration its curve
ACCURACY, FOUND = 1e-9, 1e-6
# the same of a configuration found by Newton's method, which stops at 1e-11
FOUND_BY_NEWTON = 1e-5
# rad²: a pose rounded to double precision leaves angles next to a singularity open by this over the
# distance from it; more where the elbow is nearly folded, too: the xArm's may be
ROUNDED = {"panda": 1e-14, "iiwa14": 1e-14, "xarm7": 3e-14}
# how much farther a member that counts as nearest may be
ROUGHLY = 1.5
# rad: arcs reach beyond the limits by no more than the last box that is not decided
BEYOND = 0.15
# relative
SAME = 1e-6
# configurations [rad] of an iiwa14 on curves of which only the ends, which others have, and the
# middle were once looked at, and the middle is outside the limits
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
# configurations [rad] next to a singularity, the first stretched but for 5.7e-6; and how far [rad]
# they are from the nearest curve at most
MISSED = {
    "iiwa14": [
        0.176878052873,
        1.549884477646,
        1.813836506031,
        5.7100475841e-06,
        -1.585568033,
        -2.064212006,
        -1.45936,
    ],
    "xarm7": [
        1.869737766969,
        1.645766846285,
        -5.183812248058,
        3.227667832408,
        -4.526748147774,
        2.976476879399,
        1.909424661851,
    ],
}
NEARLY = 1e-5


@pytest.fixture(params=long_but(["panda", "iiwa14"], ["panda", "iiwa14", "xarm7"]), scope="module")
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


@pytest.fixture(scope="module")
def arm(robot: Robot) -> RedundantArm:
    found = RedundantArm.of(robot.model)
    assert found is not None
    return found


def forward(robot: Robot, q: Array) -> Array:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return np.asarray(data.oMf[robot.model.getFrameId("flange")].homogeneous)


def configurations(robot: Robot, count: int, seed: int = 41) -> Array:
    return np.random.default_rng(seed).uniform(robot.limits.q_min, robot.limits.q_max, (count, 7))


def away(curves: Sequence[RedundantCurve | FreeTurn], q: Array) -> float:
    """How far [rad] q (7,) is from the nearest of the curves."""
    return min(
        float(np.abs(wrapped(each.at(np.array([each.parameter(q)]))[0] - q)).max(initial=0.0))
        for each in curves
    )


def parameters(curve: RedundantCurve, count: int, rng: np.random.Generator) -> Array:
    return np.concatenate([rng.uniform(lower, upper, count) for lower, upper in curve.arcs])


@pytest.mark.parametrize("count", long_but((30,), (30, 10_000)))
def test_every_configuration_is_on_a_curve_of_its_pose(
    robot: Robot, arm: RedundantArm, count: int
) -> None:
    for q in configurations(robot, count):
        curves = arm.self_motions(forward(robot, q), robot.limits)
        assert away(curves, q) < FOUND
        nearest = min(curves, key=lambda each: away([each], q))
        assert nearest.label == arm.label(q)


def test_every_member_reaches_the_pose(robot: Robot, arm: RedundantArm) -> None:
    rng = np.random.default_rng(42)
    for q in configurations(robot, 20):
        T = forward(robot, q)
        for curve in arm.self_motions(T):
            for member in curve.at(parameters(curve, 6, rng)):
                assert np.abs(forward(robot, member) - T).max() < ACCURACY


def newton(robot: Robot, T: Array, q: Array) -> Array | None:
    """A configuration that reaches T, from q by damped Newton steps of Pinocchio's Jacobian; None
    if none is found.
    """
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


def test_what_newtons_method_finds_is_on_a_curve(robot: Robot, arm: RedundantArm) -> None:
    """From anywhere, without regard to limits: no curve is missed."""
    rng, found = np.random.default_rng(43), 0
    for q in configurations(robot, 5):
        T = forward(robot, q)
        curves = arm.self_motions(T)
        for seed in rng.uniform(-np.pi, np.pi, (12, 7)):
            other = newton(robot, T, seed)
            if other is not None:
                found += 1
                assert away(curves, other) < FOUND_BY_NEWTON
    assert found > 20


def test_the_nearest_member_is_found_of_what_is_not_on_the_curve(
    robot: Robot, arm: RedundantArm
) -> None:
    """Also where two sheets meet, and the last angle says nothing."""
    rng = np.random.default_rng(47)
    for q in configurations(robot, 6):
        for curve in arm.self_motions(forward(robot, q), robot.limits):
            lower = curve.arcs[0][0]
            beside = curve.at(np.array([lower]))[0] + rng.normal(scale=0.1, size=7)
            members = curve.at(np.concatenate([np.linspace(*arc, 2000) for arc in curve.arcs]))
            least = np.abs(wrapped(members - beside)).max(axis=1).min()
            assert away([curve], beside) < ROUGHLY * least


def test_boxes_hold_what_they_say(robot: Robot, arm: RedundantArm) -> None:
    rng = np.random.default_rng(44)
    for q in configurations(robot, 12):
        for curve in arm.self_motions(forward(robot, q), robot.limits):
            middle = parameters(curve, 3, rng)
            half = rng.uniform(0.0, 0.5, len(middle)) ** 2
            centre, sides = curve.boxes(middle, half)
            for k in range(len(middle)):
                near = middle[k] + half[k] * np.linspace(-1, 1, 15)
                members = curve.at(near if curve.whole else np.clip(near, 0.0, np.pi))
                assert (np.abs(wrapped(members - centre[k])) <= sides[k]).all()


def test_boxes_shrink_onto_the_curve(robot: Robot, arm: RedundantArm) -> None:
    """They are of first order, but where a joint turns ever faster next to a singularity."""
    rng, width = np.random.default_rng(45), []
    for q in configurations(robot, 20):
        for curve in arm.self_motions(forward(robot, q), robot.limits):
            middle = parameters(curve, 4, rng)
            width += curve.boxes(middle, np.full(len(middle), 1e-3))[1].max(axis=1).tolist()
    assert np.median(width) < 0.05


def test_arcs_are_what_the_limits_leave(robot: Robot, arm: RedundantArm) -> None:
    """No member within the limits is cut off, and what is kept is within them but for the ends."""
    limits, rng = robot.limits, np.random.default_rng(46)
    cut, outside = 0, []
    for q in configurations(robot, 20):
        T = forward(robot, q)
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
    # next to a singularity a box is wide: what is left there is judged member by member
    assert np.quantile([*outside, 0.0], 0.5) < BEYOND


def test_a_curve_of_which_little_is_within_the_limits_gives_a_member() -> None:
    """The last joint is on its limit, and both ends of the arc are beyond limits."""
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
        for each in required_inverse_kinematics(panda, "goal").solve(forward(panda, q))
    ]
    nearest = [each.at(np.array([each.parameter(q)]))[0] for each in curves if each is not None]
    assert np.abs(wrapped(np.array(nearest) - q)).max(axis=1).min() < FOUND


@pytest.mark.parametrize("joint", [1, 3, 5])
@pytest.mark.parametrize(
    "off", long_but([0.0, 1e-8, 1e-5], [0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3])
)
def test_a_pose_on_a_singularity_or_next_to_it_is_reached(
    robot: Robot, arm: RedundantArm, joint: int, off: float
) -> None:
    """Third axis in line with the first; arm stretched, where its range allows; wrist in line:
    curves meet there.
    """
    for q in configurations(robot, 5, seed=47):
        q[joint] = np.clip(off, robot.limits.q_min[joint], robot.limits.q_max[joint])
        T = forward(robot, q)
        solutions = required_inverse_kinematics(robot, "goal").solve(T)
        assert max(np.abs(forward(robot, each.q) - T).max() for each in solutions) < ACCURACY
        if joint == 3 and robot.name == "iiwa14":
            # an arm that is stretched but for this holds its pose on loops as small, which rounding
            # of the pose hides
            curves = arm.self_motions(T, robot.limits)
            assert away(curves, q) < SETTINGS.loop_half_width
            inside = []
            for curve in curves:
                centre, sides = curve.boxes(np.array([curve.parameter(q)]), np.array([1e-6]))
                inside.append((np.abs(wrapped(q - centre[0])) <= sides[0]).all())
            assert any(inside)
            continue
        assert away(arm.self_motions(T, robot.limits), q) < max(
            FOUND, 0.0 if off == 0 else ROUNDED[robot.name] / off
        )


@pytest.mark.parametrize(
    ("joint", "step"), [(1, [1.0, 0, -1.0, 0, 0, 0, 0]), (3, [0, 0, 1.0, 0, -1.0, 0, 0])]
)
def test_what_turns_freely_on_a_singularity_is_a_curve(joint: int, step: list[float]) -> None:
    """With the first and the third axis in line, and with the third and the fifth in line on a
    stretched iiwa.
    """
    rng = np.random.default_rng(51)
    for name in ("iiwa14", "panda") if joint == 1 else ("iiwa14",):
        robot = load_robot(name)
        arm = RedundantArm.of(robot.model)
        assert arm is not None
        for q in configurations(robot, 10, seed=49):
            q[joint] = 0.0
            T = forward(robot, q)
            turned = q + rng.uniform(-2, 2) * np.array(step)
            curves = arm.self_motions(T)
            assert away(curves, turned) < FOUND
            for curve in curves:
                if isinstance(curve, FreeTurn):
                    u = rng.uniform(-np.pi, np.pi, 4)
                    centre, sides = curve.boxes(u, np.full(4, 0.1))
                    for k in range(4):
                        members = curve.at(u[k] + np.linspace(-0.1, 0.1, 9))
                        assert (np.abs(wrapped(members - centre[k])) <= sides[k]).all()
                        assert (
                            max(np.abs(forward(robot, each) - T).max() for each in members)
                            < ACCURACY
                        )


def test_limits_keep_what_turns_freely_within_them() -> None:
    """With the first and the third axis in line; only curves that may pass this are searched for
    it.
    """
    rng = np.random.default_rng(52)
    for name in ("iiwa14", "panda", "xarm7"):
        robot = load_robot(name)
        arm = RedundantArm.of(robot.model)
        assert arm is not None
        for q in configurations(robot, 10, seed=53):
            q[1], most = 0.0, np.minimum(robot.limits.q_max, np.pi)[[0, 2]]
            # both angles stay within limits, which are symmetric
            turned = q + rng.uniform(-1, 1) * (most - np.abs(q[[0, 2]])).min() * np.array(
                [1.0, 0, -1.0, 0, 0, 0, 0]
            )
            assert away(arm.self_motions(forward(robot, q), robot.limits), turned) < FOUND


def test_boxes_hold_what_turns_freely_on_a_singularity(robot: Robot, arm: RedundantArm) -> None:
    """With the third axis in line with the first, both may turn against each other while the last
    angle stands still: no curve over it has these configurations, but the box around the point has.
    """
    rng = np.random.default_rng(48)
    for q in configurations(robot, 10, seed=49):
        q[1] = 0.0
        T = forward(robot, q)
        turned = q + rng.uniform(-2, 2) * np.array([1.0, 0, -1.0, 0, 0, 0, 0])
        assert np.abs(forward(robot, turned) - T).max() < ACCURACY
        held = False
        for curve in arm.self_motions(T):
            if isinstance(curve, FreeTurn):
                continue
            # where the curve has the last angle of q
            u = np.linspace(*curve.arcs[0], 20_001)
            u = u[[np.abs(wrapped(curve.last_angle(u) - q[6])).argmin()]]
            centre, sides = curve.boxes(u, np.array([2e-4]))
            held |= bool((np.abs(wrapped(turned - centre[0])) <= sides[0]).all())
        assert held


def test_poses_out_of_reach_say_by_how_much(robot: Robot) -> None:
    """The pose shifted by that distance, away from where it is, is still out of reach; one in reach
    is not refused.
    """
    inverse = required_inverse_kinematics(robot, "goal")
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 2.0]
    with pytest.raises(UnreachablePose) as refusal:
        inverse.solve(T)
    distance = refusal.value.distance
    assert distance is not None
    # with the tool along z the arm is highest when stretched, if its wrist has no offset
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
    answers = required_inverse_kinematics(robot, "goal").solve(forward(robot, q))
    curves = list({id(each.self_motion): each.self_motion for each in answers}.values())
    assert away(curves, q) < FOUND  # type: ignore[arg-type]
    assert all(
        robot.limits.q_min[j] <= each.q[j] <= robot.limits.q_max[j]
        for each in answers
        for j in range(7)
    )


@pytest.mark.parametrize("name", MISSED)
def test_what_is_known_to_be_missed_is_nearly_found(name: str) -> None:
    robot, q = load_robot(name), np.array(MISSED[name])
    answers = required_inverse_kinematics(robot, "goal").solve(forward(robot, q))
    curves = list({id(each.self_motion): each.self_motion for each in answers}.values())
    assert FOUND < away(curves, q) < NEARLY  # type: ignore[arg-type]
