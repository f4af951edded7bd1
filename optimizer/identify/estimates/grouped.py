"""Linear least squares over rows in groups: whole moves, each of which can be left out.

Residuals of neighbouring rows are alike, so the plain formula takes far too many rows for
independent ones. What varies independently is the move. The covariance here is the jackknife's over
moves (Quenouille, Tukey; for clustered rows it is the estimate "CV3" of MacKinnon, Nielsen and Webb
2023): each move is left out once, and the spread of the estimates says how well they are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import lsq_linear
from scipy.special import stdtrit

from joulepath.models.robot import Array, Mask
from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.deadline import checkpoint

Numbers = npt.NDArray[np.int64]

# columns shorter than this, after scaling by the longest of all, do not move
LEAST_COLUMN = 1e-9
# of the eigenvalues of the column-scaled normal matrix: below it, a combination of columns does not
# move
LEAST_EIGENVALUE = 1e-9


@dataclass(frozen=True, eq=False)
class Grouped:
    """Normal equations of each group: `gram` (G, p, p), `moment` (G, p)."""

    gram: Array
    moment: Array

    @staticmethod
    def of(
        columns: Array | Sequence[Array], values: Array, weight: Array, group: Numbers, count: int
    ) -> Grouped:
        """From columns (n, p), values, weight and group (n,) of each row, of `count`.

        Columns in several parts (n, …) are put side by side, and weighted, one group at a time: all
        of them are large.
        """
        blocks = [columns] if isinstance(columns, np.ndarray) else [*columns]
        p = sum(block.shape[1] for block in blocks)
        gram, moment = np.zeros((count, p, p)), np.zeros((count, p))
        order = np.argsort(group, kind="stable")
        edges = np.searchsorted(group[order], np.arange(count + 1))
        for k in range(count):
            checkpoint()
            rows = order[edges[k] : edges[k + 1]]
            root = np.sqrt(weight[rows])
            part = root[:, None] * np.hstack([block[rows] for block in blocks])
            gram[k], moment[k] = part.T @ part, part.T @ (root * values[rows])
        return Grouped(gram, moment)


def solve(gram: Array, moment: Array, lower: Array) -> Array:
    """The x (p,) ≥ lower that minimises xᵀ gram x / 2 - momentᵀ x.

    Columns that do not move give 0 where they may, and a combination that does not move its
    shortest solution.
    """
    scale = np.sqrt(np.maximum(np.diag(gram), 0.0))
    scale = np.where(scale > LEAST_COLUMN * max(scale.max(initial=0.0), 1e-300), scale, np.inf)
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    roots = np.sqrt(np.where(values > LEAST_EIGENVALUE, values, np.inf))
    target = (vectors / roots).T @ (moment / scale)
    found = (vectors / roots) @ target / scale
    if (found >= lower).all():
        return np.asarray(found)
    matrix = (vectors * np.where(np.isfinite(roots), roots, 0.0)).T
    bounds = np.where(np.isfinite(scale), lower * np.where(np.isfinite(scale), scale, 1.0), -np.inf)
    bounded = lsq_linear(
        matrix, target, bounds=(bounds, np.full(len(bounds), np.inf)), method="bvls"
    )
    return np.asarray(np.maximum(bounded.x / scale, np.where(np.isfinite(scale), lower, -np.inf)))


def left_out(grouped: Grouped, found: Array, free: Mask, prior: Array | None = None) -> Array:
    """Estimates (G, p) with each group left out; parameters that are not `free` stay where `found`
    has them.

    `prior` (p, p) is a precision to which all of them are held besides the rows.
    """
    total = grouped.gram.sum(axis=0) + (0.0 if prior is None else prior)
    estimates = np.tile(found, (len(grouped.gram), 1))
    at = np.flatnonzero(free)
    scale = np.sqrt(np.maximum(np.diag(total)[at], 1e-300))
    for k, (gram, moment) in enumerate(zip(grouped.gram, grouped.moment, strict=True)):
        rest = (total - gram)[np.ix_(at, at)] / np.outer(scale, scale)
        pull = (gram @ found - moment)[at] / scale
        if prior is None:
            step = np.linalg.pinv(rest, rcond=LEAST_EIGENVALUE, hermitian=True) @ pull
        else:
            step = np.linalg.solve(rest, pull)
        estimates[k, at] += step / scale
    return estimates


def adjusted(grouped: Grouped, found: Array, free: Mask, prior: Array) -> Array:
    """Estimates (G, p) whose jackknife is the covariance by the errors of the rows, held to a
    precision `prior` (p, p).

    An estimate without a group falls back to the prior where that group tells most. The spread of
    such estimates has the prior's error in it, which is counted elsewhere. Here each group moves
    the estimate by its own residuals, made as large as its errors are. Residuals r of a group with
    errors e of covariance V have the covariance V - X P Xᵀ, for columns X and the estimate's
    covariance P. So V^½ (1 - V^-½ X P Xᵀ V^-½)^-½ V^-½ r has that of e (Bell and McCaffrey 2002,
    "CR2", with the prior as one more observation).
    """
    at, groups = np.flatnonzero(free), len(grouped.gram)
    root = np.linalg.inv(np.linalg.cholesky((grouped.gram.sum(axis=0) + prior)[np.ix_(at, at)]))
    estimates = np.tile(found, (groups, 1))
    # `jackknife` takes the same share of every estimate's square
    wider = np.sqrt(groups / max(groups - 1, 1))
    for k, (gram, moment) in enumerate(zip(grouped.gram, grouped.moment, strict=True)):
        told, vectors = np.linalg.eigh(root @ gram[np.ix_(at, at)] @ root.T)
        pull = vectors.T @ root @ (gram @ found - moment)[at]
        estimates[k, at] += (
            wider * root.T @ vectors @ (pull / np.sqrt(np.maximum(1 - told, LEAST_EIGENVALUE)))
        )
    return estimates


def jackknife(estimates: Array) -> Array:
    """The covariance (p, p) of an estimate from those (G, p) without each of the groups.

    Few groups are a small sample: the covariance is widened so that ± 1.645 standard deviations
    cover 90 %, as with Student's distribution. Of one group it is infinite.
    """
    groups = len(estimates)
    if groups < 2:
        return np.full((estimates.shape[1],) * 2, np.inf)
    centred = estimates - estimates.mean(axis=0)
    wider = float(stdtrit(groups - 1, 0.95)) / P95
    return np.asarray(wider**2 * (groups - 1) / groups * centred.T @ centred)


def lag_one(residuals: Array, group: Numbers) -> float:
    """Correlation of each residual (n,) with the one before, within groups of neighbouring rows; 0
    if all are 0.
    """
    near = group[1:] == group[:-1]
    square = float(residuals @ residuals)
    return float(residuals[1:][near] @ residuals[:-1][near] / square) if square > 0 else 0.0
