"""How the friction of some rows of logs, such as those of one day, differs from the fitted one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.logged_torque import motor_torque
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True, eq=False)
class MeasuredFriction:
    """Friction of the motors of a log beside the fitted friction, row by row (n, nq) [N²·m²]; 0
    where a joint is slow, or no torque of its motor was logged."""

    product: Array
    """Product of measured and fitted friction."""
    square: Array
    """Square of the fitted friction."""

    @classmethod
    def of(cls, arm: FittedArm, rows: Rows, threshold: float) -> MeasuredFriction:
        """Friction of joints that are faster than a threshold [rad/s]."""
        torque = motor_torque(arm, rows)
        use = np.isfinite(torque) & (np.abs(rows.v) > threshold)
        fitted = np.where(use, arm.friction_torque(rows) - arm.offset, 0.0)
        measured = np.where(use, torque - arm.link_torque(rows) - arm.offset, 0.0)
        return cls(fitted * measured, fitted**2)

    def factor(self, use: Mask) -> Array:
        """Measured over fitted friction (nq,) of some rows (n,); NaN of joints that are slow."""
        product, square = self.product[use].sum(axis=0), self.square[use].sum(axis=0)
        return np.asarray(product / np.where(square > 0, square, np.nan))

    def mean_factor(self, use: Mask) -> float:
        """Measured over fitted friction of all joints together."""
        square = self.square[use].sum()
        return float(self.product[use].sum() / square) if square > 0 else np.nan
