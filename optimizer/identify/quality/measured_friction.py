"""Measured over fitted friction in parts of logs, such as the rows of one day."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.logged_torque import motor_torque
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True, eq=False)
class MeasuredFriction:
    """Products of measured and fitted friction torques per row and joint, shape (n, nq) [N²·m²].

    The products are 0 for slow joints and without a logged motor torque.
    """

    product: Array
    """Product of measured and fitted friction."""
    square: Array
    """Square of the fitted friction."""

    @classmethod
    def of(cls, arm: FittedArm, rows: Rows, threshold: float) -> MeasuredFriction:
        """Friction of the joints at speeds above `threshold` [rad/s]."""
        torque = motor_torque(arm, rows)
        use = np.isfinite(torque) & (np.abs(rows.v) > threshold)
        fitted = np.where(use, arm.friction_torque(rows) - arm.offset, 0.0)
        measured = np.where(use, torque - arm.link_torque(rows) - arm.offset, 0.0)
        return cls(fitted * measured, fitted**2)

    def factor(self, use: Mask) -> Array:
        """Least-squares ratio of measured to fitted friction per joint.

        Args:
            use: mask of the rows, shape (n,).

        Returns:
            Ratio, shape (nq,) [1]; NaN for a joint without a fast row.
        """
        product, square = self.product[use].sum(axis=0), self.square[use].sum(axis=0)
        return np.asarray(product / np.where(square > 0, square, np.nan))

    def mean_factor(self, use: Mask) -> float:
        """Least-squares ratio of measured to fitted friction over all joints [1]."""
        square = self.square[use].sum()
        return float(self.product[use].sum() / square) if square > 0 else np.nan
