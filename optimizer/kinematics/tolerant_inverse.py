"""Inverse kinematics of a pose with a partly free orientation, by Newton's method from many starts.

The method needs no closed form and admits any number of joints. An arm of five joints has isolated
configurations at a given position and direction of an axis; the starts find all except those with
small basins of attraction. With more joints than constraints, the configurations are samples of a
manifold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import NoConfigurationFound
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.isolated import distinct
from joulepath.optimizer.kinematics.reach import beyond_the_arm
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose


@dataclass(frozen=True)
class TolerantInverseSettings:
    """Settings of the search for configurations."""

    round_size: int = 64
    """Number of uniformly drawn starts per round."""
    rounds: int = 16
    """Largest number of rounds."""
    idle_rounds: int = 8
    """Number of consecutive rounds without a new configuration that ends the search, once there is
    one.
    """


TOLERANT_INVERSE = TolerantInverseSettings()


def tolerant_configurations(
    arm: Arm, pose: ConeOrientedPose, count: int, target: str = "goal"
) -> Array:
    """Find distinct configurations at a pose, within the position limits.

    Args:
        arm: arm with its TCP and limits.
        pose: pose with a partly free orientation.
        count: greatest number of configurations.
        target: name of the pose in errors.

    Returns:
        Configurations, shape (n, nq) [rad], up to full turns.

    Raises:
        UnreachablePose: the position is beyond the stretched arm.
        NoConfigurationFound: the search found none.
    """
    manifold, settings = GoalManifold.of(arm, pose), TOLERANT_INVERSE
    # one turn per joint contains all configurations up to full turns
    last = np.minimum(manifold.q_max, manifold.q_min + 2 * np.pi)
    rng, idle, found = np.random.default_rng(0), 0, np.zeros((0, arm.robot.nq))
    for _ in range(settings.rounds):
        checkpoint()
        starts = rng.uniform(manifold.q_min, last, (settings.round_size, arm.robot.nq))
        q, reached = manifold.put(starts)
        both = np.vstack([found, q[reached]])
        fresh = both[distinct(both, np.zeros(len(both)))]
        idle = idle + 1 if len(fresh) == len(found) else 0
        found = fresh
        if len(found) >= count or (len(found) and idle >= settings.idle_rounds):
            break
    if not len(found):
        chain = Chain(manifold.placements, T_last_tcp(arm))
        T = pose.with_orientation(np.eye(3)).T
        raise beyond_the_arm(chain, T, target) or NoConfigurationFound(target, within_limits=False)
    return found[:count]
