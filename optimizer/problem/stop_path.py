"""A path of the TCP at a stop of a round, like that of a bead of glue."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optimizer.exceptions import InvalidProblem
from optimizer.problem.pose import Pose
from optimizer.problem.tool_path import ToolPath

STRAIGHT = ToolPath()


@dataclass(frozen=True, kw_only=True)
class StopPath:
    """The TCP goes from the stop's target, which is one pose then, over `path.via` to `goal`, and rests at both ends.

    `speed` [m/s] bounds the speed of the TCP on the way. With `split`, a path that no configuration follows whole is
    divided by reconfigurations: moves between configurations of one pose.

    Raises InvalidProblem, with the field named.
    """

    goal: Pose
    path: ToolPath = STRAIGHT
    speed: float | None = None
    split: bool = False

    def __post_init__(self) -> None:
        if self.speed is not None and not (np.isfinite(self.speed) and self.speed > 0):
            raise InvalidProblem("path.speed", "path.speed must be a positive number of metres per second.")


def at_stop(k: int, error: InvalidProblem) -> InvalidProblem:
    """An error of a path, with the field that it has as the path of stop `k`, whose `points` begin with the start."""
    field = error.field.removeprefix("path.via.")
    if field != error.field:
        field = f"path.points.{int(field) + 1}"
    return InvalidProblem(f"stops.{k}.{field.replace('path.via', 'path.points')}", str(error))
