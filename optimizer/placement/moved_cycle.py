"""A cycle whose poses are in the world, as seen from the robot base at a place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import reduce

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.scene import Scene
from joulepath.optimizer.problem.stop_path import StopPath
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import AnyOf, Single, Target

Offsets = Mapping[str, Array]
"""Poses (4, 4) by which stops or obstacles are moved in the world, by their names."""


def cycle_at(
    cycle: Cycle,
    T_world_base: Array,
    stops: Offsets | None = None,
    obstacles: Offsets | None = None,
) -> Cycle:
    """The cycle in the frame of a robot base.

    Joint positions stay as they are; `start` is the name of the start among the stops.

    Args:
        cycle: cycle with poses, obstacles, directions and gravity in the world.
        T_world_base: pose of the base in the world, shape (4, 4).
        stops: offsets of stops in the world; those not named stay.
        obstacles: offsets of obstacles in the world; those not named stay.

    Returns:
        The cycle with poses, obstacles, directions and gravity in the frame of the base.
    """
    T_base_world, stops = inverted(T_world_base), stops or {}

    def moved(name: str) -> Array:
        return composed(T_base_world, stops[name]) if name in stops else T_base_world

    return replace(
        cycle,
        arm=_arm(cycle.arm, T_base_world, obstacles or {}),
        start=moved_target(cycle.start, moved(START)),
        stops=[_stop(stop, moved(stop.name)) for stop in cycle.stops],
    )


def inverted(T: Array) -> Array:
    """The inverse of a rigid transform (4, 4), with an exactly transposed rotation."""
    back = np.eye(4)
    back[:3, :3] = T[:3, :3].T
    back[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return back


def composed(*transforms: Array) -> Array:
    """The product of rigid transforms (4, 4)."""
    return np.asarray(reduce(np.matmul, transforms))


def moved_target(target: Target, T: Array) -> Target:
    """A target with its poses moved by the transform T (4, 4); joint positions stay."""
    if isinstance(target, AnyOf):
        return replace(target, targets=tuple(_single(each, T) for each in target.targets))
    return _single(target, T)


def _single(target: Single, T: Array) -> Single:
    return _pose(target, T) if isinstance(target, Pose | ConeOrientedPose) else target


def _pose(pose: Pose | ConeOrientedPose, T: Array) -> Pose | ConeOrientedPose:
    if isinstance(pose, Pose):
        return Pose(composed(T, pose.T))
    R = T[:3, :3]
    return replace(pose, position=R @ pose.position + T[:3, 3], direction=R @ pose.direction)


def _stop(stop: Stop, T: Array) -> Stop:
    return replace(
        stop,
        target=moved_target(stop.target, T),
        approach=_line(stop.approach, T),
        retreat=_line(stop.retreat, T),
        path=None if stop.path is None else _path(stop.path, lambda pose: _pose(pose, T)),
    )


def _line(line: Line | None, T: Array) -> Line | None:
    if line is None or line.frame == "tcp":
        return line
    return replace(line, direction=T[:3, :3] @ line.direction)


def _path(
    path: StopPath, moved: Callable[[Pose | ConeOrientedPose], Pose | ConeOrientedPose]
) -> StopPath:
    via = [pose for each in path.path.via if isinstance(pose := moved(each), Pose)]
    return replace(path, goal=moved(path.goal), path=replace(path.path, via=via))


def _arm(arm: Arm, T_base_world: Array, offsets: Offsets) -> Arm:
    R, cone = T_base_world[:3, :3], arm.tool_cone
    obstacles = [
        replace(
            each,
            T_base_shape=composed(
                T_base_world, offsets.get(each.name, np.eye(4)), each.T_base_shape
            ),
        )
        for each in arm.scene.obstacles
    ]
    return replace(
        arm,
        gravity=R @ arm.gravity,
        scene=Scene(obstacles),
        tool_cone=None if cone is None else replace(cone, direction=R @ cone.direction),
    )
