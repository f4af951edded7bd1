"""Measured and modelled torques and powers over time, thinned for plots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Mask
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.logged_torque import logged_torque
from joulepath.optimizer.identify.results import Curves
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class CurveSettings:
    """Settings of the curves."""

    max_rows: int = 1500
    """Rows of all parts together; every part may exceed its share by one row."""


CURVES = CurveSettings()


def curves_of(parts: Sequence[tuple[FittedArm, Rows, Mask]], threshold: float) -> Curves:
    """Measured and modelled curves of rows in motion.

    Args:
        parts: arm, rows and mask (n,) of the rows to show.
        threshold: speed above which the torque of a joint is modelled [rad/s].
    """
    allowed = [mask & ~rows.rest for _, rows, mask in parts]
    every = max(1, -(-sum(int(mask.sum()) for mask in allowed) // CURVES.max_rows))
    curves = list[Curves]()
    for (arm, rows, _), mask in zip(parts, allowed, strict=True):
        thinned = np.zeros_like(mask)
        thinned[np.flatnonzero(mask)[::every]] = True
        shown = rows.take(thinned)
        torque = logged_torque(arm, shown)
        moving = np.isfinite(torque) & (np.abs(shown.v) > threshold)
        curves.append(
            Curves(
                log=shown.log,
                move=shown.move,
                time=shown.time,
                torque=torque,
                modelled_torque=np.where(moving, arm.measured_torque(shown), np.nan),
                power=shown.power,
                modelled_power=np.where(np.isfinite(shown.power), arm.power(shown)[0], np.nan),
            )
        )
    return Curves(
        **{
            name: np.concatenate([getattr(part, name) for part in curves])
            for name in vars(curves[0])
        }
    )
