"""A path of the TCP at a stop of a cycle, like that of a bead of glue."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.targets import SampledPoses, Target, members
from joulepath.optimizer.problem.tool_path import ToolPath

STRAIGHT = ToolPath()


@dataclass(frozen=True, kw_only=True)
class StopPath:
    """The TCP goes from the stop's target, which is one pose then, over `path.via` to `goal`, and
    rests at both ends.

    Where the tool may turn about an axis on the way, either end may leave the rotation about it
    free, too. Of a stop with several targets, a path leads from each of them to the one of `goals`
    in its place.

    `speed` [m/s] bounds the speed of the TCP on the way. With `split`, a path that no configuration
    follows whole is divided by reconfigurations: moves between configurations of one pose.

    Raises InvalidProblem, with the field named.
    """

    goal: Pose | ConeOrientedPose
    goals: SampledPoses | None = None
    path: ToolPath = STRAIGHT
    speed: float | None = None
    split: bool = False

    def __post_init__(self) -> None:
        if self.speed is not None and not (np.isfinite(self.speed) and self.speed > 0):
            raise InvalidProblem(
                "path.speed", "path.speed must be a positive number of metres per second."
            )

    def check_ends(self, target: Target) -> None:
        """Raises InvalidProblem, with the field named, for poses at the ends between which there is
        no path.

        `target` is that of the stop.
        """
        several = self.goals is not None and len(members(target)) == len(self.goals.targets)
        if not several and not isinstance(target, Pose | ConeOrientedPose):
            raise InvalidProblem(
                "target", "The target of a stop with a path is one pose: its start."
            )
        ends = {"start": (0, target), "goal": (len(self.path.via) + 1, self.goal)}
        for name, (point, end) in ends.items():
            if not isinstance(end, ConeOrientedPose):
                continue
            field = f"path.points.{point}.orientation"
            if self.split:
                raise InvalidProblem(
                    field,
                    "A path that is to be divided has its orientation in full at both ends: leave "
                    "out split.",
                )
            try:
                self.path.check_free(name, end)
            except InvalidProblem as error:
                raise InvalidProblem(field, str(error)) from None


def at_stop(k: int, error: InvalidProblem) -> InvalidProblem:
    """An error of a path, with the field that it has as the path of stop `k`, whose `points` begin
    with the start.
    """
    field = error.field.removeprefix("path.via.")
    if field != error.field:
        field = f"path.points.{int(field) + 1}"
    return InvalidProblem(f"stops.{k}.{field.replace('path.via', 'path.points')}", str(error))
