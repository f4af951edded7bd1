"""Cone for an axis of the tool along the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arrays import unit_vector
from joulepath.optimizer.problem.scalars import check_number

LEAST_HALF_ANGLE = 1e-3
"""Least half angle [rad]; a narrower cone cannot be kept in double precision."""


@dataclass(frozen=True)
class ToolCone:
    """Cone within which an axis of the tool stays. Both vectors are normalised.

    Attributes:
        axis: axis of the tool in the TCP frame, shape (3,).
        direction: axis of the cone in the base frame, shape (3,).
        half_angle: half angle of the cone [rad].

    Raises:
        InvalidProblem: a vector is zero, or `half_angle` is not between LEAST_HALF_ANGLE and pi.
    """

    axis: Array
    direction: Array
    half_angle: float

    def __post_init__(self) -> None:
        for name in ("axis", "direction"):
            object.__setattr__(self, name, unit_vector(getattr(self, name), f"tool_cone.{name}"))
        check_number(
            "tool_cone.half_angle", self.half_angle, "radians", least=LEAST_HALF_ANGLE, most=np.pi
        )
