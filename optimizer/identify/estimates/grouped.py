"""Linear least squares over groups of rows, with leave-one-group-out estimates.

Residuals of neighbouring rows are correlated, so the textbook covariance counts far too many rows
as independent. Moves are independent of one another. The covariance here is the jackknife over
moves (Quenouille, Tukey; for clustered rows it is the estimator CV3 of MacKinnon, Nielsen and Webb
2023): the fit is repeated without one move at a time, and the spread of these estimates is the
standard error. Weights of rows reject outliers, or balance joints of different noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import lsq_linear, nnls
from scipy.special import stdtrit

from joulepath.models.robot import Array, Mask
from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.deadline import checkpoint

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class RankSettings:
    """Tolerances that decide whether a column of the regression counts as zero or dependent."""

    column_tolerance: float = 1e-9
    """Length of a column over the longest one, up to which the column counts as zero [1]."""
    eigenvalue_tolerance: float = 1e-9
    """Eigenvalue of the normal matrix of columns of unit length, up to which a combination of
    columns counts as zero [1]."""
    least_part: float = 1e-3
    """Coefficient of a column in such a combination of unit length, above which the rows do not
    determine the unknown of the column [1]."""


RANK = RankSettings()


class Totals(NamedTuple):
    """Normal equations of all rows: `gram` (p, p), `moment` (p,)."""

    gram: Array
    moment: Array


@dataclass(frozen=True, eq=False)
class GroupedEquations:
    """Normal equations of every group of rows: `gram` (G, p, p), `moment` (G, p)."""

    gram: Array
    moment: Array

    @staticmethod
    def of(
        columns: Array | Sequence[Array], values: Array, weight: Array, group: IntArray, count: int
    ) -> GroupedEquations:
        """Normal equations of a weighted regression.

        Args:
            columns: columns (n, p). Several parts (n, …) are stacked side by side and weighted one
                group at a time, because all of them together are large.
            values: right-hand side (n,).
            weight: weight of a row (n,).
            group: group of a row (n,), from 0.
            count: number of groups.
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
        return GroupedEquations(gram, moment)

    def total(self, precision: Array | float = 0.0, mean: Array | None = None) -> Totals:
        """Normal equations of all groups, with a Gaussian prior.

        Args:
            precision: precision (p, p) of the prior.
            mean: mean (p,) of the prior; None for 0.
        """
        pull = 0.0 if mean is None else precision @ mean
        return Totals(self.gram.sum(axis=0) + precision, self.moment.sum(axis=0) + pull)


def column_lengths(gram: Array, rank: RankSettings = RANK) -> Array:
    """Lengths (p,) of the columns of a normal matrix (p, p); infinite for those that count as zero,
    so that divided by its length a zero column stays zero."""
    lengths = np.sqrt(np.maximum(np.diag(gram), 0.0))
    shortest = rank.column_tolerance * max(lengths.max(initial=0.0), 1e-300)
    return np.where(lengths > shortest, lengths, np.inf)


def solve_bounded(
    gram: Array, moment: Array, lower: Array | float = -np.inf, rank: RankSettings = RANK
) -> Array:
    """Minimise xᵀ gram x / 2 - momentᵀ x subject to x ≥ lower.

    A zero column gets the value 0 if its bound allows it; among dependent columns the shortest
    solution is taken.

    Args:
        gram: normal matrix (p, p).
        moment: right-hand side (p,).
        lower: lower bounds (p,), or one of all; -inf for none.
        rank: tolerances of zero and dependent columns.

    Returns:
        The minimiser x (p,).
    """
    scale, lower = column_lengths(gram, rank), np.broadcast_to(lower, len(moment))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    roots = np.sqrt(np.where(values > rank.eigenvalue_tolerance, values, np.inf))
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


def solve_definite(gram: Array, moment: Array, lower: Array) -> Array:
    """Minimise xᵀ gram x / 2 - momentᵀ x subject to x ≥ lower, for a positive definite matrix.

    The unknowns are scaled to columns of unit length, because precisions of figures differ by many
    orders of magnitude. Those without bounds are eliminated, and the others are found by active
    sets (Lawson and Hanson 1974). `lsq_linear` begins with a singular value decomposition by
    LAPACK's divide and conquer, which may not converge for more than 25 unknowns with clusters of
    singular values, as priors of independent figures have.

    Args:
        gram: positive definite normal matrix (p, p).
        moment: right-hand side (p,).
        lower: lower bounds (p,); -inf for none.

    Returns:
        The minimiser x (p,); unknowns at their bounds equal these exactly.
    """
    scale = np.sqrt(np.diag(gram))
    unbounded = np.isneginf(lower)
    order, k = np.argsort(~unbounded, kind="stable"), int(unbounded.sum())
    upper = np.linalg.cholesky((gram / np.outer(scale, scale))[np.ix_(order, order)]).T
    target = np.linalg.solve(upper.T, (moment / scale)[order])
    least = (lower * scale)[order[k:]]
    above, _ = nnls(upper[k:, k:], target[k:] - upper[k:, k:] @ least)
    rest = target[:k] - upper[:k, k:] @ (least + above)
    found = np.empty_like(moment)
    found[order[:k]] = np.linalg.solve(upper[:k, :k], rest)
    found[order[k:]] = least + above
    at_bound = np.zeros(len(moment), dtype=bool)
    at_bound[order[k:]] = above <= 0
    return np.asarray(np.where(at_bound, lower, found / scale))


class LeaveOneOut(NamedTuple):
    """Solutions without one of G groups at a time."""

    estimates: Array
    """Estimates (G, p)."""
    undetermined: Mask
    """Parameters (p,) that the rows without some group do not determine."""


def leave_one_out(
    grouped: GroupedEquations, found: Array, free: Mask, prior: Array | None = None
) -> LeaveOneOut:
    """Estimate the parameters without one group at a time.

    Args:
        grouped: normal equations of the G groups.
        found: estimate (p,) from all groups.
        free: estimated parameters (p,); all others keep the value of `found`.
        prior: precision (p, p) of a Gaussian prior around the estimate's prior mean.
    """
    total = grouped.total(0.0 if prior is None else prior).gram
    estimates = np.tile(found, (len(grouped.gram), 1))
    undetermined = np.zeros(len(found), dtype=bool)
    at = np.flatnonzero(free)
    # a prior leaves no column zero
    of_free = total[np.ix_(at, at)]
    scale = column_lengths(of_free) if prior is None else np.sqrt(np.diag(of_free))
    for k, (gram, moment) in enumerate(zip(grouped.gram, grouped.moment, strict=True)):
        rest = (total - gram)[np.ix_(at, at)] / np.outer(scale, scale)
        pull = (gram @ found - moment)[at] / scale
        if prior is None:
            values, vectors = np.linalg.eigh(rest)
            zero = values <= RANK.eigenvalue_tolerance * values.max(initial=0.0)
            step = vectors @ (vectors.T @ pull / np.where(zero, np.inf, values))
            undetermined[at] |= np.linalg.norm(vectors[:, zero], axis=1) > RANK.least_part
        else:
            step = np.linalg.solve(rest, pull)
        estimates[k, at] += step / scale
    return LeaveOneOut(estimates, undetermined)


def residual_replicates(grouped: GroupedEquations, found: Array, free: Mask, prior: Array) -> Array:
    """Estimates (G, p) whose jackknife is the covariance due to the errors of the rows.

    With a prior, an estimate without the most informative group falls back to the prior mean.
    The spread of such estimates contains the error of the prior, and that error is counted
    elsewhere. Here, every group moves the estimate by its own residuals, inflated to the size of
    its errors. Let X be the columns of a group, V the covariance of its errors e, and P the
    covariance of the estimate. The residuals r then have the covariance V - X P Xᵀ, and
    V^½ (1 - V^-½ X P Xᵀ V^-½)^-½ V^-½ r has the covariance of e (Bell and McCaffrey 2002, "CR2",
    with the prior as one more observation).

    Args:
        grouped: normal equations of the G groups.
        found: estimate (p,) from all groups and the prior.
        free: estimated parameters (p,).
        prior: precision (p, p) of the prior.
    """
    at, groups = np.flatnonzero(free), len(grouped.gram)
    root = np.linalg.inv(np.linalg.cholesky(grouped.total(prior).gram[np.ix_(at, at)]))
    estimates = np.tile(found, (groups, 1))
    # `jackknife` multiplies every square by (G - 1) / G
    wider = np.sqrt(groups / max(groups - 1, 1))
    for k, (gram, moment) in enumerate(zip(grouped.gram, grouped.moment, strict=True)):
        share, vectors = np.linalg.eigh(root @ gram[np.ix_(at, at)] @ root.T)
        pull = vectors.T @ root @ (gram @ found - moment)[at]
        estimates[k, at] += (
            wider
            * root.T
            @ vectors
            @ (pull / np.sqrt(np.maximum(1 - share, RANK.eigenvalue_tolerance)))
        )
    return estimates


def jackknife(estimates: Array) -> Array:
    """Covariance (p, p) of an estimate from its leave-one-group-out estimates (G, p).

    Few groups are a small sample: the covariance is widened so that ± 1.645 standard deviations
    cover 90 % of Student's distribution. With a single group it is infinite.
    """
    groups = len(estimates)
    if groups < 2:
        return np.full((estimates.shape[1],) * 2, np.inf)
    # the mean of equal numbers may differ from them by a rounding error
    changes = estimates - estimates[0]
    centred = changes - changes.mean(axis=0)
    wider = float(stdtrit(groups - 1, 0.95)) / P95
    return np.asarray(wider**2 * (groups - 1) / groups * centred.T @ centred)


def lag_one_correlation(residuals: Array, group: IntArray) -> float:
    """Correlation of neighbouring residuals (n,) of the same group; 0 if all residuals are 0."""
    neighbours = group[1:] == group[:-1]
    square = float(residuals @ residuals)
    if square <= 0:
        return 0.0
    return float(residuals[1:][neighbours] @ residuals[:-1][neighbours] / square)


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
