"""The stops of a cycle, and the moves that lead over them."""

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
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.scene import Scene
from joulepath.optimizer.problem.stop_path import STRAIGHT, StopPath
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.problem.tool_path import ToolPath

MoveKind = Literal["move", "line", "path"]
# what follows the name of a stop in those of the outer ends of its lines, and of the start of its
# path
APPROACH, RETREAT, ENTRY = "/approach", "/retreat", "/entry"


@dataclass(frozen=True, kw_only=True)
class Stop:
    """A target at which the arm comes to rest, for `dwell` [s]. Its orientation may be free in
    part.

    `payload` is carried from here on, the dwell included: grasped, or released with a payload
    without mass; None leaves it unchanged. `branch` restricts the inverse kinematics branches of
    this stop. The moves into the stop, a line included, keep within `limits`, `tcp_speed` and
    `elbow_speed` [m/s], too; position limits are the arm's.

    The TCP moves along the line `approach` into the stop and along `retreat` out of it, and rests
    at their outer ends. At the stop it follows a `path`, from the target to where the path ends;
    there it dwells, and the payload changes. At the stop, on its lines and its path the obstacles
    named in `obstacles_ignored` do not count.

    If `via`, the arm passes through the target without a rest, on its way to the next stop at which
    it rests. The limits of all stops of such a motion hold for all of it.
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

    @property
    def free_ends(self) -> tuple[bool, bool]:
        """Whether the target leaves the orientation free in part, and whether the end of the stop's
        path does.
        """
        at_end = self.path is not None and isinstance(self.path.goal, ConeOrientedPose)
        return isinstance(self.target, ConeOrientedPose), at_end

    @property
    def entry(self) -> str:
        """Name of the place of the target: the stop, or the start of its path."""
        return self.name + ENTRY if self.path else self.name

    @property
    def places(self) -> list[str]:
        """Names of the places at which the arm rests, in their order: the ends of the stop's path,
        or the stop, and the outer ends of its lines."""
        return [
            *([self.name + APPROACH] if self.approach else []),
            *([self.entry] if self.path else []),
            self.name,
            *([self.name + RETREAT] if self.retreat else []),
        ]


@dataclass(frozen=True)
class PlannedMove:
    """A move of a cycle from one place to another, by their names, with `arm`; along a `tool_path`
    if there is one.

    It passes `through` stops in their order. After it `arm_after` rests, for `dwell` [s].
    `at_stop`: the goal is a stop, and neither an outer end nor the start.
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
        """The moves from rest to rest if the arm stops where it passes through."""
        places = [self.start, *self.through]
        stopping = [
            PlannedMove(a, b, self.arm, self.arm, at_stop=True) for a, b in pairwise(places)
        ]
        return [*stopping, replace(self, start=places[-1], through=())]


def passing(move: PlannedMove, stops: Sequence[Stop]) -> PlannedMove:
    """The move that passes through stops on its way, within the limits of all of them."""
    return replace(
        move, arm=reduce(_within, stops, move.arm), through=tuple(stop.name for stop in stops)
    )


def moves_over(stop: Stop, place: str, before: Arm, after: Arm) -> list[PlannedMove]:
    """The moves from `place` to a stop, along its lines and its path; `before` and `after` it the
    arm carries other payloads."""
    moves, resting, before = list[PlannedMove](), _at(after, stop), _within(before, stop)
    there = PlannedMove(place, stop.name, before, resting, stop.dwell, at_stop=True)
    if stop.path is not None:
        there = PlannedMove(place, stop.entry, before, _at(before, stop))
    if stop.approach is not None:
        outer = stop.name + APPROACH
        moves.append(PlannedMove(place, outer, before, before))
        on_line = _on_way(before, stop, stop.approach.speed)
        there = replace(there, start=outer, arm=on_line, kind="line", tool_path=STRAIGHT)
    moves.append(there)
    if stop.path is not None:
        on_path, way = _on_way(before, stop, stop.path.speed), stop.path.path
        moves.append(
            PlannedMove(stop.entry, stop.name, on_path, resting, stop.dwell, "path", way, True)
        )
    if stop.retreat is not None:
        on_line = _on_way(after, stop, stop.retreat.speed)
        moves.append(
            PlannedMove(stop.name, stop.name + RETREAT, on_line, after, 0.0, "line", STRAIGHT)
        )
    return moves


def _within(arm: Arm, stop: Stop) -> Arm:
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


def _on_way(arm: Arm, stop: Stop, speed: float | None) -> Arm:
    """The arm on a line of a stop or on its path: no faster than this allows."""
    return _at(arm, stop).no_faster_than(speed)


def _at(arm: Arm, stop: Stop) -> Arm:
    """The arm at a stop, on its lines and its path: without the obstacles that do not count
    there."""
    if not stop.obstacles_ignored:
        return arm
    return replace(
        arm,
        scene=Scene(
            [each for each in arm.scene.obstacles if each.name not in stop.obstacles_ignored]
        ),
    )
