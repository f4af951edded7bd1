"""A cycle through the configurations of a cycle at a nearby place.

A place a few centimetres away mostly has its best cycle in nearly the same configurations. With
these configurations as targets, a cycle has a single candidate per move in place of thousands and
is computed in a fraction of the time. The cycle passes the same poses, so its energy is never below
the least one at its place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.tcp import flange_pose, tcp_pose
from joulepath.optimizer.placement.moved_cycle import composed, inverted
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.targets import Single, members


@dataclass(frozen=True)
class NearbySettings:
    """Settings of nearby configurations."""

    reach: float = 0.1
    """Distance from a place up to which the best cycles mostly have its configurations [m]."""
    farthest: float = 0.8
    """Greatest change of a joint that counts as near [rad]."""
    inset: float = 0.02
    """Distance from its limit to which a joint beyond it is set back, from where the other joints
    of a redundant arm reach the pose again [rad]."""
    set_back: int = 8
    """Most times that joints are set back."""
    residual: float = 1e-9
    """Greatest pose error of a configuration [m, rad], far below the 1e-6 that the certificate
    allows at an end."""


NEARBY = NearbySettings()


@dataclass(frozen=True, eq=False)
class Visited:
    """The configurations of a cycle, and the poses behind them.

    Attributes:
        q: joint positions by the name of the stop or start, shape (nq,) [rad].
        T_base_stop: pose of the body of the stop in the base frame, by the same names, (4, 4).
    """

    q: Mapping[str, Array]
    T_base_stop: Mapping[str, Array]


def nearby_cycle(cycle: Cycle, visited: Visited, T_base_stop: Mapping[str, Array]) -> Cycle | None:
    """The cycle through configurations near the ones of another place.

    Args:
        cycle: cycle at its place, in the given order.
        visited: configurations of the same cycle at another place.
        T_base_stop: pose of the body of a stop in the base frame, by its name, shape (4, 4).

    Returns:
        The cycle with joint positions as its targets; None if some are out of reach or far away, or
        if a stop has a path.
    """
    if cycle.order is not None or any(stop.path is not None for stop in cycle.stops):
        return None
    names = [START, *(stop.name for stop in cycle.stops)]
    targets = [cycle.start, *(stop.target for stop in cycle.stops)]
    if not set(names) <= set(visited.q):
        return None
    chain, limits = Chain.of(cycle.arm.robot.model), cycle.arm.active_limits
    q, poses = list[Array](), list[Array]()
    for name, target in zip(names, targets, strict=True):
        T = composed(T_base_stop[name], inverted(visited.T_base_stop[name]))
        q.append(visited.q[name])
        poses.append(_pose(cycle, members(target), visited.q[name], T))
    at = np.array(q)
    near, inside, residual = at, np.ones(at.shape, dtype=bool), np.zeros(len(at))
    for _ in range(1 + NEARBY.set_back):
        # a redundant arm may have a solution within its limits even if the nearest one has not
        within = np.clip(near, limits.q_min + NEARBY.inset, limits.q_max - NEARBY.inset)
        near, residual = solved(chain, np.where(inside, near, within), np.array(poses))
        inside = (near >= limits.q_min) & (near <= limits.q_max)
        if inside.all():
            break
    if not (inside.all() and (residual <= NEARBY.residual).all()):
        return None
    if np.abs(near - at).max() > NEARBY.farthest:
        return None
    stops = [replace(stop, target=to) for stop, to in zip(cycle.stops, near[1:], strict=True)]
    return replace(cycle, start=near[0], stops=stops)


def _pose(cycle: Cycle, targets: tuple[Single, ...], q: Array, T: Array) -> Array:
    """Flange pose (4, 4) at a stop after a displacement T (4, 4) of its body in the base frame."""
    arm = cycle.arm
    if not any(isinstance(each, Pose | ConeOrientedPose) for each in targets):
        return flange_pose(tcp_pose(arm, q), arm.T_flange_tcp)
    if len(targets) == 1 and isinstance(targets[0], Pose):
        return flange_pose(targets[0].T, arm.T_flange_tcp)
    return flange_pose(composed(T, tcp_pose(arm, q)), arm.T_flange_tcp)
