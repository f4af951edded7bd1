"""Configurations of a pose with a free orientation, or on a self-motion: projection onto the
manifold or curve, and motion along it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, ConeOrientedPose, Pose, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.kinematics.tcp import tcp_pose

# largest pose error, far below the tolerance of the certificate [m, rad]
REACHED = 1e-9
# displacement from the manifold [rad]
ASIDE = 0.03
# largest distance of the projection, relative to the displacement
FARTHER = 4.0
# smallest share of arbitrary configurations returned to the manifold by the projection
MOSTLY = 0.9
# relative tolerance of a minimum: quadratic steps end next to a corner of a sum of distances
FLAT = 0.02
ROBOTS = ("panda", "xarm7", "gen3", "ur5e")


def poses(arm: Arm, q: Array) -> list[ConeOrientedPose]:
    """Goal poses around q (nq,): turned about an axis, in or on the edge of a cone, or free."""
    T, axis = tcp_pose(arm, q), np.array([0.3, -0.2, 1.0])
    pointing = T[:3, :3] @ axis / np.linalg.norm(axis)
    across = np.cross(pointing, [1.0, 0.0, 0.0])
    beside = np.cos(0.4) * pointing + np.sin(0.4) * across / np.linalg.norm(across)
    return [
        ConeOrientedPose.about(Pose(T), axis),
        ConeOrientedPose(T[:3, 3], axis, pointing, 0.5),
        ConeOrientedPose(T[:3, 3], axis, beside, 0.4),
        ConeOrientedPose(T[:3, 3]),
    ]


def pose_errors(arm: Arm, pose: ConeOrientedPose, q: Array) -> Array:
    """Pose errors [m, rad] of configurations (n, nq), by forward kinematics and the arc cosine."""
    T = tcp_pose(arm, q)
    cosine = np.einsum("nij,j,i->n", T[:, :3, :3], pose.axis, pose.direction)
    sine = np.linalg.norm(np.cross(T[:, :3, :3] @ pose.axis, pose.direction), axis=1)
    beyond = np.maximum(np.arctan2(sine, cosine) - pose.half_angle, 0.0)
    return np.asarray(np.maximum(np.linalg.norm(T[:, :3, 3] - pose.position, axis=1), beyond))


def inner(arm: Arm, rng: np.random.Generator) -> Array:
    limits = arm.active_limits
    return np.asarray(rng.uniform(*np.clip([0.8 * limits.q_min, 0.8 * limits.q_max], -2.5, 2.5)))


@pytest.mark.parametrize("name", ROBOTS)
def test_configurations_near_the_manifold_are_projected_nearby(name: str) -> None:
    """A first-order proposal is projected nearby, not onto a distant member of the self-motion."""
    arm, rng = Arm(robot=load_robot(name)), np.random.default_rng(5)
    for q in [inner(arm, rng) for _ in range(5)]:
        for pose in poses(arm, q):
            beside = q + rng.uniform(-ASIDE, ASIDE, (20, len(q)))
            found, reached = GoalManifold.of(arm, pose).put(beside)
            assert reached.mean() > MOSTLY
            assert pose_errors(arm, pose, found[reached]).max() < REACHED
            assert np.median(np.abs(found - beside).max(axis=1)) < FARTHER * ASIDE


@pytest.mark.parametrize("name", ROBOTS)
def test_successful_projections_reach_the_pose_within_the_limits(name: str) -> None:
    """Projections from arbitrary configurations reach the pose, or report a failure.

    The configurations include singular ones, and some on limits.
    """
    arm, rng = Arm(robot=load_robot(name)), np.random.default_rng(6)
    limits = arm.active_limits
    anywhere = rng.uniform(limits.q_min, limits.q_max, (40, arm.robot.nq))
    anywhere[:5], anywhere[5:10], anywhere[10:15] = 0.0, limits.q_min, limits.q_max
    weights = rng.uniform(0.1, 10.0, arm.robot.nq)
    for pose in poses(arm, inner(arm, rng)):
        manifold = GoalManifold.of(arm, pose)
        to = inner(arm, rng)
        for found, reached in (
            manifold.put(anywhere),
            manifold.nearest(anywhere, np.tile(to, (40, 1)), weights),
        ):
            assert np.isfinite(found).all()
            assert (found >= limits.q_min).all() and (found <= limits.q_max).all()
            assert pose_errors(arm, pose, found[reached]).max(initial=0.0) < REACHED


@pytest.mark.parametrize("name", ["xarm7", "ur5e"])
def test_the_distance_is_locally_smallest(name: str) -> None:
    """No nearby configuration of the manifold is much closer."""
    arm, rng = Arm(robot=load_robot(name)), np.random.default_rng(7)
    weights = arm.friction_law.coulomb
    for pose in poses(arm, inner(arm, rng)):
        manifold, to = GoalManifold.of(arm, pose), inner(arm, rng)
        begun, reached = manifold.put(to + rng.normal(scale=0.5, size=(12, len(to))))
        begun = begun[reached]
        came, reached = manifold.nearest(begun, np.tile(to, (len(begun), 1)), weights)
        assert reached.mean() > MOSTLY
        for q in came[reached]:
            beside, held = manifold.put(q + rng.normal(scale=0.02, size=(40, len(q))))
            assert np.abs(q - to) @ weights <= (np.abs(beside[held] - to) @ weights).min() * (
                1 + FLAT
            )


def test_other_joints_take_over_from_a_joint_on_its_limit() -> None:
    """If a joint reaches its limit halfway, it stays there and the other joints still approach."""
    arm, weights = Arm(robot=load_robot("panda")), np.ones(7)
    q = np.array([0.2, 0.3, -0.1, -1.8, 0.2, 1.9, 0.4])
    pose, to = poses(arm, q)[0], q + np.array([0.6, 0.2, 0.4, -0.2, 0.5, 0.0, -0.5])
    free, reached = GoalManifold.of(arm, pose).nearest(q[None], to[None], weights)
    joint = int(np.abs(free[0] - q)[:6].argmax())
    ends = {"q_min": arm.active_limits.q_min.copy(), "q_max": arm.active_limits.q_max.copy()}
    side = "q_min" if free[0, joint] < q[joint] else "q_max"
    ends[side][joint] = (q[joint] + free[0, joint]) / 2
    narrow = replace(arm, limits=replace(arm.active_limits, **ends))
    found, held = GoalManifold.of(narrow, pose).nearest(q[None], to[None], weights)
    assert (
        reached.all()
        and held.all()
        and found[0, joint] == pytest.approx(ends[side][joint], abs=REACHED)
    )
    assert np.abs(free[0] - to).sum() < np.abs(found[0] - to).sum() < np.abs(q - to).sum()
    assert pose_errors(arm, pose, found).max() < REACHED


# largest pose error [m, rad]
HELD = 1e-9
# relative error of differences with steps of 1e-3
DIFFERENCES = 1e-2


def curve_of(name: str, seed: int) -> tuple[HeldPose, Array]:
    """The curve through a random configuration in the middle of the joint ranges.

    Returns the curve and the configuration.
    """
    robot = load_robot(name)
    limits, rng = robot.limits, np.random.default_rng(seed)
    q = limits.q_min + rng.uniform(0.3, 0.7, robot.nq) * (limits.q_max - limits.q_min)
    return HeldPose.of(Arm(robot=robot), q), q


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7", "gen3"])
def test_what_is_put_on_the_curve_holds_the_pose(name: str) -> None:
    for seed in range(5):
        curve, q = curve_of(name, seed)
        on_it = curve.put(q)
        assert on_it is not None and np.abs(on_it - q).max() < HELD
        away = q + 0.1 * curve.tangent(q)
        found = curve.put(away)
        assert found is not None
        assert np.abs(tcp_pose(Arm(robot=load_robot(name)), found) - curve.T).max() < HELD
        # The projection returns across the curve, not along it.
        assert np.abs(found - q).max() > 0.5 * np.abs(away - q).max()


def test_a_joint_that_would_leave_its_range_stays_on_its_limit() -> None:
    curve, q = curve_of("panda", 1)
    tangent = curve.tangent(q)
    joint = int(np.abs(tangent).argmax())
    beyond = q + 0.2 * tangent * np.sign(tangent[joint])
    narrow = replace(
        curve, q_max=np.where(np.arange(7) == joint, q + 0.1 * abs(tangent[joint]), curve.q_max)
    )
    found = narrow.put(beyond)
    assert found is not None
    assert found[joint] == pytest.approx(narrow.q_max[joint], abs=HELD)
    assert np.abs(tcp_pose(Arm(robot=load_robot("panda")), found) - curve.T).max() < HELD


def test_an_unreachable_pose_is_held_nowhere() -> None:
    curve, q = curve_of("panda", 2)
    far = curve.T.copy()
    far[:3, 3] *= 5.0
    assert replace(curve, T=far).put(q) is None


@pytest.mark.parametrize("name", ["panda", "gen3"])
def test_tangent_and_bend_are_those_of_the_curve(name: str) -> None:
    h = 1e-3
    for seed in range(5):
        curve, q = curve_of(name, seed)
        tangent = curve.tangent(q)
        after, before = curve.put(q + h * tangent), curve.put(q - h * tangent)
        assert after is not None and before is not None
        assert (after - before) / (2 * h) == pytest.approx(tangent, abs=DIFFERENCES)
        bend, seen = curve.bend(q, tangent), (after + before - 2 * q) / (h * h)
        assert seen == pytest.approx(bend, abs=DIFFERENCES * max(1.0, float(np.abs(bend).max())))
        assert abs(float(bend @ tangent)) < 1e-6 * max(1.0, float(np.abs(bend).max()))
