"""The cone in which an axis of the tool stays along the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import unit_vector

# a narrower cone [rad] cannot be kept in double precision
LEAST_HALF_ANGLE = 1e-3


@dataclass(frozen=True)
class ToolCone:
    """The tool's `axis` (3,), in the TCP frame, stays within `half_angle` [rad] of `direction`
    (3,), in the base frame.

    Both vectors are normalised. Raises InvalidProblem if one of them is zero, or if `half_angle` is
    not between LEAST_HALF_ANGLE and pi.
    """

    axis: Array
    direction: Array
    half_angle: float

    def __post_init__(self) -> None:
        for name in ("axis", "direction"):
            object.__setattr__(self, name, unit_vector(getattr(self, name), f"tool_cone.{name}"))
        if not LEAST_HALF_ANGLE <= self.half_angle <= np.pi:
            raise InvalidProblem(
                "tool_cone.half_angle",
                f"tool_cone.half_angle must be between {LEAST_HALF_ANGLE} and pi rad.",
            )
