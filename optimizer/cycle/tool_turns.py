"""Orientations of the tool tried at stops, or at the ends of their paths, that leave them free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.kinematics.orientation_tolerance import (
    nearest_orientation,
    sample_orientations,
)
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.kinematics.tolerant_inverse import tolerant_configurations
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import SampledPoses

Turns = tuple[Array, Array]
"""Rotation vectors (3,) [rad] in the TCP frame by which the tool is turned: at a stop, or at the
start of its path, and at the end of the path."""


@dataclass(frozen=True)
class ToolTurnSettings:
    """Settings of the orientations tried at first."""

    angles: tuple[float, ...] = tuple(np.arange(12) * (np.pi / 6))
    """Angles about a free axis [rad]."""
    orientations: int = 24
    """Number of orientations where more than an axis is free."""
    with_full_turns: int = 3
    """Number of orientations of a stop tried with full turns of the joints."""


TOOL_TURNS = ToolTurnSettings()


def turns_all_around(arm: Arm, stop: Stop) -> list[Turns]:
    """Turns at a stop over all orientations, or over those that an arm with few joints can hold.

    If both ends of a path are free, the tool keeps its angle on the path.

    Raises:
        UnreachablePose: the position of the stop is beyond an arm with few joints.
        NoConfigurationFound: an arm with few joints was not found to reach the stop.
    """
    (start, _), none = stop.free_ends, np.zeros(3)
    if stop.path is not None:
        axis = _axis_of(stop)
        turns = [angle * axis for angle in TOOL_TURNS.angles]
        return [(turn, none) if start else (none, turn) for turn in turns]
    assert isinstance(stop.target, ConeOrientedPose)
    if arm.robot.nq < POSE_FREEDOMS:
        place, count = f"stops/{stop.name}", TOOL_TURNS.orientations
        held = tcp_pose(arm, tolerant_configurations(arm, stop.target, count, place))
        (reference,) = sample_orientations(stop.target, 1)
        return [(np.asarray(pin.log3(reference.T @ T[:3, :3])), none) for T in held]
    if stop.target.freedom == 1:
        return [(angle * stop.target.axis, none) for angle in TOOL_TURNS.angles]
    reference, *others = sample_orientations(stop.target, TOOL_TURNS.orientations)
    return [(np.asarray(pin.log3(reference.T @ R)), none) for R in (reference, *others)]


def turns_near(stop: Stop, at: Turns, step: float) -> list[Turns]:
    """Turns at the ends of a stop's path: the given ones, and one step away at every free end.

    Args:
        stop: stop with a path.
        at: given turns.
        step: step of the angle [rad].
    """
    axis = _axis_of(stop)
    turns = [(0.0, -step, step) if free else (0.0,) for free in stop.free_ends]
    # opposite turns of both ends turn the tool on the path, and change more than either alone
    return [(at[0] + a * axis, at[1] + b * axis) for a, b in product(*turns) if a * b >= 0]


def evenly_from(turns: Sequence[Turns], at: Turns) -> list[Turns]:
    """A few turns, evenly spread over their list and starting with `at`."""
    first, count = next(k for k, turn in enumerate(turns) if turn is at), TOOL_TURNS.with_full_turns
    return [turns[(first + (k * len(turns)) // count) % len(turns)] for k in range(count)]


def turns_of_solution(
    found: CycleSolution, tried: Mapping[str, Sequence[Turns]]
) -> dict[str, Turns]:
    """Turns chosen at every stop by a solution."""
    goals = {move.planned.goal: move.solution.goal.target for move in found.moves}
    passed = {at.stop: at.target for move in found.moves for at in move.passes}
    return {name: turns[(goals | passed)[name]] for name, turns in tried.items()}


def with_turns(cycle: Cycle, tried: Mapping[str, Sequence[Turns]], bounded: bool = False) -> Cycle:
    """The cycle with poses in place of free orientations.

    Args:
        cycle: cycle with free orientations.
        tried: turns at every stop, by its name.
        bounded: whether the bound of the cycle must hold for all orientations.
    """
    stops = [
        _stop_with_turns(stop, tried[stop.name], bounded) if stop.name in tried else stop
        for stop in cycle.stops
    ]
    return replace(cycle, stops=stops)


def _stop_with_turns(stop: Stop, tried: Sequence[Turns], bounded: bool) -> Stop:
    if stop.path is None:
        pose = stop.target
        assert isinstance(pose, ConeOrientedPose)
        return replace(stop, target=turned_poses(pose, tried, bounded))
    ends = [_ends(stop, *turns) for turns in tried]
    free_start, free_goal = (
        ConeOrientedPose.about(end, _axis_of(stop)) if bounded else None for end in ends[0]
    )
    goals = SampledPoses(tuple(goal for _, goal in ends), free_goal)
    path = replace(stop.path, goal=ends[0][1], goals=goals)
    starts = SampledPoses(tuple(start for start, _ in ends), free_start)
    return replace(stop, target=starts, path=path)


def turned_poses(
    pose: ConeOrientedPose, turns: Sequence[Turns], bounded: bool = False
) -> SampledPoses:
    """A pose of partly free orientation at given turns; see `with_turns`."""
    (reference,) = sample_orientations(pose, 1)
    poses = tuple(_turned(pose, reference, turn) for turn, _ in turns)
    return SampledPoses(poses, pose if bounded else None)


def _axis_of(stop: Stop) -> Array:
    """Unit axis (3,) of the tool about which it may turn on the path of a stop."""
    assert stop.path is not None and stop.path.path.about is not None
    axis = np.array(stop.path.path.about)
    return np.asarray(axis / np.linalg.norm(axis))


def _ends(stop: Stop, at_start: Array, at_goal: Array) -> tuple[Pose, Pose]:
    """Poses at both ends of a stop's path.

    The tool is turned from a fixed orientation at the start, and from the orientation nearest to
    the pose before at the goal.
    """
    start, path = stop.target, stop.path
    assert path is not None and isinstance(start, Pose | ConeOrientedPose)
    if isinstance(start, ConeOrientedPose):
        (reference,) = sample_orientations(start, 1)
        start = _turned(start, reference, at_start)
    goal = path.goal
    if isinstance(goal, ConeOrientedPose):
        before = [start, *path.path.via][-1]
        goal = _turned(goal, nearest_orientation(goal, before.T[:3, :3]), at_goal)
    return start, goal


def _turned(pose: ConeOrientedPose, reference: Array, turn: Array) -> Pose:
    """The pose with the orientation `reference` (3, 3), turned."""
    return pose.with_orientation(reference @ pin.exp3(turn))
