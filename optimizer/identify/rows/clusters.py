"""Clusters of rows: what is left out as one to see how well an estimate is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.identify.rows.fit_rows import Rows

Numbers = npt.NDArray[np.int64]

# fewer motions than this tell little of the spread: single moves take their place; if they are as
# few, seconds of them
LEAST_GROUPS = 5
SECOND = 1.0
# more clusters than this tell nothing more and take time
MOST_CLUSTERS = 60
# of residuals that are rounding
LEAST_VARIANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Clusters:
    """The cluster (n,) of each row, numbered from 0 to `count` - 1."""

    of_row: Numbers
    count: int


def clusters_of(rows: Rows) -> Clusters:
    """Motions as clusters, or moves where there are few motions, or seconds where there are few
    moves.
    """
    unit = rows.group
    if len(rows.groups) < LEAST_GROUPS:
        unit = rows.move
        if len(np.unique(rows.move[~rows.rest])) < LEAST_GROUPS:
            unit = np.floor(np.cumsum(rows.weight) / SECOND).astype(np.int64)
    number = np.unique(unit, return_inverse=True)[1]
    count = int(number.max()) + 1
    if count > MOST_CLUSTERS:
        number, count = number * MOST_CLUSTERS // count, MOST_CLUSTERS
    return Clusters(np.asarray(number, dtype=np.int64), count)


def shared_variance(residuals: Array, weight: Array, clusters: Clusters) -> float:
    """Variance of a row (n,) that tells as much as if all rows were independent, in the unit of the
    residuals squared.

    The rows of a move share an error that the model cannot express. The mean residual of a cluster
    of n rows has then a larger variance than 1/n of a row's.
    """
    weighted = np.sqrt(weight) * residuals
    size = np.bincount(clusters.of_row, minlength=clusters.count)
    total = np.bincount(clusters.of_row, weighted, minlength=clusters.count)
    shared = float(np.mean(total[size > 0] ** 2 / size[size > 0]))
    alone = float(weighted @ weighted / max(weight.sum(), 1e-300))
    return max(shared, alone) + LEAST_VARIANCE
