"""Axes of a controller: their positions in degrees, from the joint positions of a robot's model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import FormatUnsuitable


@dataclass(frozen=True)
class Axes:
    """Axis = sign · joint + offset [degrees]; one sign (1 or -1) and one offset per joint. None: all 1, all 0."""

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
                raise FormatUnsuitable(format, f"{format}.{name} must have {nq} numbers: one per joint.")
