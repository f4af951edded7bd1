"""Stops of a cycle, and the moves between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from typing import Literal

import numpy as np

from joulepath.models.robot import Limits
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.scene import Scene
from joulepath.optimizer.problem.stop_path import STRAIGHT, StopPath
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.problem.tool_path import ToolPath

MoveKind = Literal["move", "line", "path"]
APPROACH = "/approach"
"""Suffix of a stop's name for the outer end of its approach."""
RETREAT = "/retreat"
"""Suffix of a stop's name for the outer end of its retreat."""
ENTRY = "/entry"
"""Suffix of a stop's name for the start of its path."""


@dataclass(frozen=True, kw_only=True)
class Stop:
    """A target at which the arm rests, or which it passes.

    The arm rests at the outer ends of its lines and at both ends of its path; it dwells and changes
    the payload at the end of the path.

    Attributes:
        name: name of the stop.
        target: target, with a partly free orientation perhaps.
        dwell: duration of the rest [s].
        payload: payload from here on, dwell included; one without mass releases a part, None
            changes nothing.
        branch: allowed branches of this stop.
        limits: joint limits of the moves into the stop, lines included; position limits are the
            arm's.
        tcp_speed: speed limit of the TCP in these moves [m/s].
        elbow_speed: speed limit of the elbow in these moves [m/s].
        approach: line of the TCP into the stop.
        retreat: line of the TCP out of the stop.
        path: path from the target on.
        obstacles_ignored: names of obstacles ignored at the stop, on its lines and its path.
        via: whether the arm passes through the target without a rest, within the limits of all
            stops of this motion.

    Raises:
        InvalidProblem: a field has another type; names the field.
    """

    name: str
    target: Target
    dwell: float = 0.0
    payload: Payload | None = None
    branch: BranchFilter | None = None
    limits: Limits | None = None
    tcp_speed: float | None = None
    elbow_speed: float | None = None
    approach: Line | None = None
    retreat: Line | None = None
    path: StopPath | None = None
    obstacles_ignored: Sequence[str] = ()
    via: bool = False

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def free_ends(self) -> tuple[bool, bool]:
        """Whether the orientation is partly free at the target, and at the end of the stop's
        path.
        """
        at_end = self.path is not None and isinstance(self.path.goal, ConeOrientedPose)
        return isinstance(self.target, ConeOrientedPose), at_end

    @property
    def entry(self) -> str:
        """Name of the place of the target: the stop, or the start of its path."""
        return self.name + ENTRY if self.path else self.name

    @property
    def places(self) -> list[str]:
        """Names of the places of rest in order: outer end of the approach, ends of the path or the
        stop, and outer end of the retreat.
        """
        return [
            *([self.name + APPROACH] if self.approach else []),
            *([self.entry] if self.path else []),
            self.name,
            *([self.name + RETREAT] if self.retreat else []),
        ]


@dataclass(frozen=True)
class PlannedMove:
    """A move of a cycle between two places.

    Attributes:
        start: name of the place at its start.
        goal: name of the place at its end.
        arm: arm with its payload during the move.
        arm_after: arm with its payload at rest after the move.
        dwell: duration of this rest [s].
        kind: kind of the move.
        tool_path: path of the TCP; None for a free move.
        at_stop: whether the goal is a stop, not an outer end or the start.
        through: names of the stops passed, in order.
    """

    start: str
    goal: str
    arm: Arm
    arm_after: Arm
    dwell: float = 0.0
    kind: MoveKind = "move"
    tool_path: ToolPath | None = None
    at_stop: bool = False
    through: tuple[str, ...] = ()

    @property
    def parts(self) -> list[PlannedMove]:
        """The moves from rest to rest with a rest at every passed stop."""
        places = [self.start, *self.through]
        stopping = [
            PlannedMove(a, b, self.arm, self.arm, at_stop=True) for a, b in pairwise(places)
        ]
        return [*stopping, replace(self, start=places[-1], through=())]


def passing(move: PlannedMove, stops: Sequence[Stop]) -> PlannedMove:
    """The move through further stops, within the limits of all of them."""
    return replace(
        move,
        arm=reduce(_within_limits, stops, move.arm),
        through=tuple(stop.name for stop in stops),
    )


def moves_over(stop: Stop, place: str, before: Arm, after: Arm) -> list[PlannedMove]:
    """Moves from a place to a stop and along its lines and path.

    Args:
        stop: the stop.
        place: place before the stop.
        before: arm with its payload before the stop.
        after: arm with its payload after the stop.
    """
    moves, resting, before = (
        list[PlannedMove](),
        _at_stop(after, stop),
        _within_limits(before, stop),
    )
    arrival = PlannedMove(place, stop.name, before, resting, stop.dwell, at_stop=True)
    if stop.path is not None:
        arrival = PlannedMove(place, stop.entry, before, _at_stop(before, stop))
    if stop.approach is not None:
        outer = stop.name + APPROACH
        moves.append(PlannedMove(place, outer, before, before))
        on_line = _on_path(before, stop, stop.approach.speed)
        arrival = replace(arrival, start=outer, arm=on_line, kind="line", tool_path=STRAIGHT)
    moves.append(arrival)
    if stop.path is not None:
        on_path, way = _on_path(before, stop, stop.path.speed), stop.path.path
        moves.append(
            PlannedMove(stop.entry, stop.name, on_path, resting, stop.dwell, "path", way, True)
        )
    if stop.retreat is not None:
        on_line = _on_path(after, stop, stop.retreat.speed)
        moves.append(
            PlannedMove(stop.name, stop.name + RETREAT, on_line, after, 0.0, "line", STRAIGHT)
        )
    return moves


def _within_limits(arm: Arm, stop: Stop) -> Arm:
    """The arm on its way to a stop, within the limits of both."""
    if stop.limits is not None:
        own, rates = arm.active_limits, ("v_max", "a_max", "j_max", "tau_max")
        tighter = {
            name: np.minimum(getattr(own, name), getattr(stop.limits, name)) for name in rates
        }
        arm = replace(arm, limits=own.tightened(**tighter))
    if stop.elbow_speed is not None:
        arm = replace(arm, elbow_speed=min(stop.elbow_speed, arm.elbow_speed or np.inf))
    return arm.no_faster_than(stop.tcp_speed)


def _on_path(arm: Arm, stop: Stop, speed: float | None) -> Arm:
    """The arm on a line or path of a stop, within its speed limit."""
    return _at_stop(arm, stop).no_faster_than(speed)


def _at_stop(arm: Arm, stop: Stop) -> Arm:
    """The arm at a stop, on its lines and its path: without ignored obstacles."""
    if not stop.obstacles_ignored:
        return arm
    return replace(
        arm,
        scene=Scene(
            [each for each in arm.scene.obstacles if each.name not in stop.obstacles_ignored]
        ),
    )
