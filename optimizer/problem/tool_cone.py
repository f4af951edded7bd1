"""The cone in which an axis of the tool stays along the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array
from optimizer.exceptions import InvalidProblem

# a shorter vector gives no direction; a narrower cone [rad] cannot be kept in double precision
LEAST_LENGTH, LEAST_HALF_ANGLE = 1e-6, 1e-3


@dataclass(frozen=True)
class ToolCone:
    """The tool's `axis` (3,), in the TCP frame, stays within `half_angle` [rad] of `direction` (3,), in the base frame.

    Both vectors are normalised. Raises InvalidProblem.
    """

    axis: Array
    direction: Array
    half_angle: float

    def __post_init__(self) -> None:
        for name in ("axis", "direction"):
            vector = np.array(getattr(self, name), dtype=float)
            length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
            if not (np.isfinite(length) and length > LEAST_LENGTH):
                raise InvalidProblem(f"tool_cone.{name}", f"tool_cone.{name} must be three numbers, not all zero.")
            object.__setattr__(self, name, vector / length)
        if not LEAST_HALF_ANGLE <= self.half_angle <= np.pi:
            raise InvalidProblem(
                "tool_cone.half_angle", f"tool_cone.half_angle must be between {LEAST_HALF_ANGLE} and pi rad."
            )
