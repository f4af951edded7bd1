"""Row weights of iteratively reweighted least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.estimates.grouped import IntArray

NORMAL_MEDIAN_ABS = 0.6744897501960817
"""Median of |x| for a standard normal x."""


@dataclass(frozen=True)
class BisquareSettings:
    """Settings of Tukey's bisquare weights."""

    cutoff: float = 4.685
    """Robust standard deviations from which on a residual has no weight [1]; 95 % efficient for
    Gaussian errors."""


BISQUARE = BisquareSettings()


def bisquare_weights(residuals: Array, settings: BisquareSettings = BISQUARE) -> Array:
    """Tukey's bisquare weights (n,) of residuals (n,).

    Residuals are scaled by their median absolute value. If most residuals are 0, all weights are 1.
    """
    size = float(np.median(np.abs(residuals))) / NORMAL_MEDIAN_ABS if residuals.size else 0.0
    if size <= 0:
        return np.ones_like(residuals)
    return np.asarray(np.maximum(1 - (residuals / (settings.cutoff * size)) ** 2, 0.0) ** 2)


def inverse_variance_weights(joint: IntArray, residuals: Array, robust: bool) -> Array:
    """Weights (n,) of rows by the inverse variance of the residuals of their joint.

    Args:
        joint: joint of a row (n,), from 0.
        residuals: residuals (n,).
        robust: whether to multiply by bisquare weights, against outliers.
    """
    weight = np.ones_like(residuals)
    for number in np.unique(joint):
        rows = joint == number
        share = bisquare_weights(residuals[rows]) if robust else np.ones(int(rows.sum()))
        variance = float(share @ residuals[rows] ** 2 / max(share.sum(), 1e-300))
        weight[rows] = share / max(variance, 1e-12)
    return weight
