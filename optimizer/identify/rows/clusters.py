"""Clusters of rows: the units that the jackknife leaves out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.estimates.grouped import IntArray, bisquare_weights
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class ClusterSettings:
    """Settings of the clusters of rows."""

    min_count: int = 5
    """Motions, or moves, below which the next smaller unit serves as cluster: fewer clusters do
    not measure a spread."""
    max_count: int = 60
    """Largest number of clusters; more cost time and do not improve the spread."""
    slice_duration: float = 1.0
    """Duration of the smallest unit, a slice of a move [s]."""
    min_relative_sd: float = 1e-3
    """Smallest error of a row over the root mean square of the measured values [1]. No sensor and
    no model is better; a log without noise would outweigh any prior up to rounding errors."""
    variance_floor: float = 1e-9
    """Smallest variance of a row, for measured values that are all zero [unit²]."""


CLUSTERS = ClusterSettings()


@dataclass(frozen=True, eq=False)
class Clusters:
    """Partition of rows: the cluster `of_row` (n,) of every row, from 0 to `count` - 1."""

    of_row: IntArray
    count: int


def clusters_of(rows: Rows, settings: ClusterSettings = CLUSTERS) -> Clusters:
    """Partition rows into motions; with few motions into moves, with few moves into slices, of
    which there are at least two."""
    unit = rows.group
    if len(rows.groups) < settings.min_count:
        unit = rows.move
        if len(np.unique(rows.move[~rows.rest])) < settings.min_count:
            middle = np.cumsum(rows.weight) - rows.weight / 2
            duration = min(settings.slice_duration, float(rows.weight.sum()) / 2)
            unit = np.floor(middle / duration).astype(np.int64)
    number = np.unique(unit, return_inverse=True)[1]
    count = int(number.max()) + 1
    if count > settings.max_count:
        number, count = number * settings.max_count // count, settings.max_count
    return Clusters(np.asarray(number, dtype=np.int64), count)


def effective_variance(
    measured: Array, residuals: Array, weight: Array, clusters: Clusters
) -> float:
    """Variance of a row as if all rows were independent.

    The rows of a move share an error that the model does not express, so the mean residual of a
    cluster of n rows has a larger variance than 1/n of the variance of a row. The returned
    variance makes both agree.

    Args:
        measured: measured values (n,).
        residuals: residuals (n,).
        weight: weights (n,) of the rows.
        clusters: partition of the rows.

    Returns:
        The variance, in the squared unit of the measured values.
    """
    weighted = np.sqrt(weight) * residuals
    size = np.bincount(clusters.of_row, minlength=clusters.count)
    total = np.bincount(clusters.of_row, weighted, minlength=clusters.count)
    shared = float(np.mean(total[size > 0] ** 2 / size[size > 0]))
    independent = float(weighted @ weighted / max(weight.sum(), 1e-300))
    least = CLUSTERS.min_relative_sd**2 * float(np.mean(measured**2))
    return max(shared, independent) + least + CLUSTERS.variance_floor


def effective_weights(
    channel: IntArray, measured: Array, residuals: Array, clusters: Clusters, robust: bool = False
) -> Array:
    """Weights (n,) of rows by the inverse of the effective variance of their channel.

    Args:
        channel: channel of a row (n,): its joint, or its axis.
        measured: measured values (n,).
        residuals: residuals (n,).
        clusters: partition of the rows.
        robust: whether outliers have less weight.
    """
    weight = np.ones_like(residuals)
    for number in np.unique(channel):
        rows = channel == number
        share = bisquare_weights(residuals[rows]) if robust else weight[rows]
        part = Clusters(clusters.of_row[rows], clusters.count)
        weight[rows] = share / effective_variance(measured[rows], residuals[rows], share, part)
    return weight
