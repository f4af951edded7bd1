"""A path of the TCP at a stop of a cycle, such as a bead of glue."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.scalars import check_speed
from joulepath.optimizer.problem.targets import SampledPoses, Target, members
from joulepath.optimizer.problem.tool_path import ToolPath

STRAIGHT = ToolPath()


@dataclass(frozen=True, kw_only=True)
class StopPath:
    """Path of the TCP from the target of a stop over `path.via` to `goal`, with rests at both ends.

    The target of the stop is then a single pose. If the tool may turn about an axis on the path,
    either end may leave the rotation about this axis free.

    Attributes:
        goal: end of the path.
        goals: ends for a stop with several targets, one for every target in order.
        path: shape, intermediate poses and tolerances.
        speed: speed limit of the TCP [m/s]; None without one.
        split: whether a path that no configuration follows whole is divided by reconfigurations,
            moves between configurations of one pose.

    Raises:
        InvalidProblem: a value is malformed; names the field.
    """

    goal: Pose | ConeOrientedPose
    goals: SampledPoses | None = None
    path: ToolPath = STRAIGHT
    speed: float | None = None
    split: bool = False

    def __post_init__(self) -> None:
        check_fields(self, "path.")
        check_speed("path.speed", self.speed)

    def check_ends(self, target: Target) -> None:
        """Check the poses at both ends of the path.

        Args:
            target: target of the stop.

        Raises:
            InvalidProblem: there is no path between the poses; names the field.
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
                    "A path to be divided must have full orientations at both ends: leave out "
                    "split.",
                )
            try:
                self.path.check_free(name, end)
            except InvalidProblem as error:
                raise InvalidProblem(field, str(error)) from None


def at_stop(k: int, error: InvalidProblem) -> InvalidProblem:
    """The error of a path with its field in a request: the path of stop `k`, with the start in
    `points`.
    """
    field = error.field.removeprefix("path.via.")
    if field != error.field:
        field = f"path.points.{int(field) + 1}"
    return InvalidProblem(f"stops.{k}.{field.replace('path.via', 'path.points')}", str(error))
