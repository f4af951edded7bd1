"""Estimates of figures, and how well they are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.estimates.grouped import jackknife

Name = tuple[str, int | None]
"""Name of a figure and number of its joint from 0; None for a figure of the whole arm."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Values of p figures, with leave-one-cluster-out replicates for their covariance."""

    names: tuple[Name, ...]
    value: Array
    """Values (p,)."""
    replicates: Array
    """Values (G, p) without one cluster of moves at a time."""
    reasons: tuple[str, ...]
    """Reason (p,) for keeping the robot's own value; empty for a figure found from the logs."""
    prior_covariance: Array
    """Covariance (p, p) due to errors of figures assumed before the fit."""
    remarks: tuple[str, ...] = ()
    """Remark (p,) on a figure found from the logs, or empty; no remarks if there are none."""

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the values."""
        return jackknife(self.replicates) + self.prior_covariance


def join_estimates(estimates: list[Estimate], shared: Array | None = None) -> Estimate:
    """Concatenate estimates from the same clusters.

    Args:
        estimates: the parts; parts without figures are skipped.
        shared: prior covariance between the figures of the first and the second part.
    """
    estimates = [each for each in estimates if each.names]
    if not estimates:
        return Estimate((), np.zeros(0), np.zeros((0, 0)), (), np.zeros((0, 0)))
    sizes = np.cumsum([0, *(len(each.names) for each in estimates)])
    covariance = np.zeros((sizes[-1], sizes[-1]))
    for each, start, end in zip(estimates, sizes[:-1], sizes[1:], strict=True):
        covariance[start:end, start:end] = each.prior_covariance
    if shared is not None:
        covariance[: sizes[1], sizes[1] :] = shared
        covariance[sizes[1] :, : sizes[1]] = shared.T
    return Estimate(
        names=tuple(name for each in estimates for name in each.names),
        value=np.concatenate([each.value for each in estimates]),
        replicates=np.hstack([each.replicates for each in estimates]),
        reasons=tuple(reason for each in estimates for reason in each.reasons),
        prior_covariance=covariance,
        remarks=tuple(
            remark for each in estimates for remark in each.remarks or ("",) * len(each.names)
        ),
    )
