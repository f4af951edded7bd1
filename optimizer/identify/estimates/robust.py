"""Weights that keep outliers out: iteratively reweighted least squares."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array

Numbers = npt.NDArray[np.int64]

# residuals beyond so many robust standard deviations have no weight (Tukey's bisquare, 95 %
# efficient)
CUT = 4.685
# median of |x| of a normal distribution with standard deviation 1
MEDIAN = 0.6744897501960817


def bisquare_weights(residuals: Array) -> Array:
    """Tukey's weights (n,) of residuals (n,), scaled by their median size; all 1 where most
    residuals are 0.
    """
    size = float(np.median(np.abs(residuals))) / MEDIAN if residuals.size else 0.0
    if size <= 0:
        return np.ones_like(residuals)
    return np.asarray(np.maximum(1 - (residuals / (CUT * size)) ** 2, 0.0) ** 2)


def weights_of(joint: Numbers, residuals: Array, robust: bool) -> Array:
    """Of each row (n,): the inverse variance of its joint's residuals, less for outliers if
    `robust`.
    """
    weight = np.ones_like(residuals)
    for each in np.unique(joint):
        rows = joint == each
        of_joint = bisquare_weights(residuals[rows]) if robust else np.ones(int(rows.sum()))
        variance = float(of_joint @ residuals[rows] ** 2 / max(of_joint.sum(), 1e-300))
        weight[rows] = of_joint / max(variance, 1e-12)
    return weight
