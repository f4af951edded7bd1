"""Poses that a redundant arm reaches only in narrow ranges of its self-motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    GoalInCollision,
    Obstacle,
    Pose,
    Problem,
    Scene,
    Sphere,
    StartInCollision,
    load_robot,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.search.ends import SAMPLING
from tests.selection import long_but

ROBOT = load_robot("panda")
HOME = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785])
T = tcp_pose(Arm(robot=ROBOT), np.array([[0.3, 0.4, -0.2, -1.9, 0.3, 2.2, 0.6]]))[0]
# found by a search for balls that all coarse samples touch and some others do not
BALLS = ([0.354, -0.104, 0.443], [0.559, 0.103, 0.41], [0.103, -0.2, 0.289], [0.023, -0.154, 0.3])


def among(*centres: list[float]) -> Arm:
    placed = [np.vstack([np.column_stack([np.eye(3), c]), [0, 0, 0, 1]]) for c in centres]
    return Arm(
        robot=ROBOT,
        scene=Scene(
            [Obstacle(f"ball {k}", Sphere(0.01), at, margin=0.0) for k, at in enumerate(placed)]
        ),
    )


def clearance(arm: Arm, q: Array) -> Array:
    model = CollisionModel(arm)
    return np.asarray(model.pair_distances(model.frames(q)).distance.min(axis=1))


@pytest.mark.parametrize("end", long_but(["goal"], ["start", "goal"]))
def test_a_posture_between_colliding_samples_is_found(end: str) -> None:
    arm = among(*BALLS)
    samples = required_inverse_kinematics(ROBOT, "goal").solve(
        T, None, ROBOT.limits, windings=False, members=SAMPLING.members
    )
    assert len(samples) > 50
    assert (clearance(arm, np.array([each.q for each in samples])) < 0).all()
    ends = {"start": HOME, "goal": HOME, end: Pose(T)}
    found = optimize(Problem(arm=arm, **ends))  # type: ignore[arg-type]
    assert found.certificate.clearance is not None
    assert found.certificate.clearance.min_clearance >= 0
    q = found.trajectory.spline.curve(0.0 if end == "start" else found.duration)
    np.testing.assert_allclose(tcp_pose(arm, q[None])[0], T, atol=1e-6)
    assert clearance(arm, q[None])[0] >= CLEARANCE_CONSTRAINT.reserve - 1e-9


@pytest.mark.parametrize(("end", "error"), [("start", StartInCollision), ("goal", GoalInCollision)])
def test_a_pose_without_a_free_posture_is_refused(end: str, error: type[Exception]) -> None:
    """A ball in the flange, which does not move along the self-motion."""
    arm = among(*BALLS, T[:3, 3].tolist())
    ends: dict[str, Any] = {"start": HOME, "goal": HOME, end: Pose(T)}
    with pytest.raises(error):
        optimize(Problem(arm=arm, **ends))
