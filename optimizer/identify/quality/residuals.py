"""Correlation of the residuals of a fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.identify.estimates.grouped import lag_one_correlation
from joulepath.optimizer.identify.fits.fitting import FitResult
from joulepath.optimizer.identify.quality.interval import MeasuredFriction
from joulepath.optimizer.identify.results import Residuals
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class ResidualSettings:
    """Settings of the judgement of residuals."""

    max_white_correlation: float = 0.3
    """Correlation of neighbouring residuals below which they count as independent [1]."""


RESIDUALS = ResidualSettings()


def residuals_of(fitted: FitResult, rows: Rows, threshold: float) -> Residuals:
    """Correlation of neighbouring residuals of torques and power.

    Args:
        fitted: the fit.
        rows: rows of the fit.
        threshold: speed above which the torque of a joint counts [rad/s].
    """
    error = fitted.arm.logged_torque(rows) - fitted.arm.measured_torque(rows)
    moving = np.abs(rows.v) > threshold
    of_torque = np.full(rows.v.shape[1], np.nan)
    for joint in range(len(of_torque)):
        use = moving[:, joint] & np.isfinite(error[:, joint])
        if use.any():
            of_torque[joint] = lag_one_correlation(error[use, joint], rows.move[use])
    with_power, of_power = np.isfinite(rows.power), np.nan
    if with_power.any():
        part = rows.take(with_power)
        of_power = lag_one_correlation(part.power - fitted.arm.power(part)[0], part.move)
    friction = MeasuredFriction.of(fitted.arm, rows, threshold)
    sessions = [friction.mean_factor(rows.log == log) for log in np.unique(rows.log)]
    known = np.append(of_torque, of_power)
    known = known[np.isfinite(known)]
    return Residuals(
        torque_lag_one=of_torque,
        power_lag_one=of_power,
        white=bool((known < RESIDUALS.max_white_correlation).all()),
        sessions=tuple(each for each in sessions if np.isfinite(each)),
    )
