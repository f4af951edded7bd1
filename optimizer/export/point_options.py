"""Options of formats with points: number of points, and axes of the controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.scalars import check_within


@dataclass(frozen=True)
class PointOptions:
    """Number of points, and the axes of the controller: axis = sign · joint + offset [degrees]."""

    tolerance: float = 0.005
    """Deviation from the spline that determines the number of points [rad]."""
    signs: tuple[Literal[1, -1], ...] | None = None
    """Sign of each joint, 1 or -1; None for 1."""
    offsets: tuple[float, ...] | None = None
    """Offset of each joint [degrees]; None for 0."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_within("tolerance", self.tolerance, OPTION_RANGES.tolerance, "radians")
        for offset in () if self.offsets is None else self.offsets:
            check_within("offsets", offset, OPTION_RANGES.offset, "degrees")

    def degrees(self, q: Array) -> list[str]:
        """Axes of joint positions (nq,) [rad], to 1e-6 degrees."""
        values = np.rad2deg(q)
        if self.signs is not None:
            values = values * np.array(self.signs)
        if self.offsets is not None:
            values = values + np.array(self.offsets)
        return [f"{x + 0.0:.6f}" for x in values]

    def check(self, format: str, nq: int) -> None:
        """Check that signs and offsets have one number per joint.

        Raises:
            FormatUnsuitable: the number is wrong.
        """
        for name, given in (("signs", self.signs), ("offsets", self.offsets)):
            if given is not None and len(given) != nq:
                raise FormatUnsuitable(
                    format, f"{format}.{name} must have {nq} numbers: one per joint."
                )
