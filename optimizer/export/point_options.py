"""Options of the formats that give a controller points: how many of them, and in which axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.errors import FormatUnsuitable


@dataclass(frozen=True)
class PointOptions:
    """Number of points, and the axes of the controller: axis = sign · joint + offset [degrees].

    `tolerance` [rad] is the deviation from the spline that the number of points is chosen for.
    `signs` (1 or -1) and `offsets` [degrees] have one number per joint; None stands for 1 and for
    0.
    """

    tolerance: float = 0.005
    signs: tuple[int, ...] | None = None
    offsets: tuple[float, ...] | None = None

    def degrees(self, q: Array) -> list[str]:
        """Axes of joint positions q (nq,) [rad], to 1e-6 degrees."""
        values = np.rad2deg(q)
        if self.signs is not None:
            values = values * np.array(self.signs)
        if self.offsets is not None:
            values = values + np.array(self.offsets)
        return [f"{x + 0.0:.6f}" for x in values]

    def check(self, format: str, nq: int) -> None:
        """Raises FormatUnsuitable unless there are as many signs and offsets as joints, if any."""
        for name, given in (("signs", self.signs), ("offsets", self.offsets)):
            if given is not None and len(given) != nq:
                raise FormatUnsuitable(
                    format, f"{format}.{name} must have {nq} numbers: one per joint."
                )
