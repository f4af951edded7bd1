"""Measured and modelled torques and powers over time, of so many rows as a picture shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Mask
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.fits.fitting import motor_torque
from joulepath.optimizer.identify.results import Curves
from joulepath.optimizer.identify.rows.fit_rows import Rows

MOST = 1500
"""Rows of all parts together, but for one more of each part."""


def curves_of(parts: Sequence[tuple[FittedArm, Rows, Mask]], threshold: float) -> Curves:
    """Every k-th of the rows in motion that each part's mask (n,) allows, with what its arm makes
    of them.

    The torque of a joint is modelled where it moves faster than the threshold [rad/s].
    """
    allowed = [mask & ~rows.rest for _, rows, mask in parts]
    every = max(1, -(-sum(int(mask.sum()) for mask in allowed) // MOST))
    found = list[Curves]()
    for (arm, rows, _), mask in zip(parts, allowed, strict=True):
        thin = np.zeros_like(mask)
        thin[np.flatnonzero(mask)[::every]] = True
        shown = rows.take(thin)
        torque = motor_torque(arm, shown)
        told = np.isfinite(torque) & (np.abs(shown.v) > threshold)
        found.append(
            Curves(
                log=shown.log,
                move=shown.move,
                time=shown.time,
                torque=torque,
                modelled_torque=np.where(told, arm.torque(shown), np.nan),
                power=shown.power,
                modelled_power=np.where(np.isfinite(shown.power), arm.power(shown)[0], np.nan),
            )
        )
    return Curves(
        **{name: np.concatenate([getattr(each, name) for each in found]) for name in vars(found[0])}
    )
