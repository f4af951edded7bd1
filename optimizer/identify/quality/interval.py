"""Interval of a predicted energy: errors of the figures, of the move and of the day.

The covariance of the figures alone is far too narrow. Every move has an error beyond the figures of
the model, and friction differs from day to day. Both errors are measured: the first with moves left
out of the fit, the second with logs of different days, by their measured over fitted friction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from joulepath.models.robot import Array, Mask
from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.estimates.grouped import jackknife
from joulepath.optimizer.identify.fits.fitting import FitResult
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class IntervalSettings:
    """Settings of the interval of a predicted energy."""

    min_session_sd: float = 0.025
    """Smallest relative standard deviation of the friction of a joint from day to day [1]: 2 to 3 %
    in twelve logs of a UR10e over two months, and few logs may happen to be alike."""
    min_sessions: int = 3
    """Logs below which the deviation is not measured."""
    min_own_share: float = 0.1
    """Smallest share of the moves' own errors in the square of their mean errors [1]."""
    median_square: float = 0.455
    """Median of the square of a standard normal variable [1]."""


INTERVAL = IntervalSettings()


@dataclass(frozen=True)
class Spread:
    """Errors beyond the figures of the model."""

    move_sd: float
    """Standard deviation of the mean power of a move [W]."""
    session_sd: Array
    """Relative standard deviations of the friction between days, by joint (nq,) [1]. The deviations
    of different joints are independent."""


def energy_sd(fitted: FitResult, spread: Spread, rows: Rows) -> tuple[float, float]:
    """Predict the energy of rows with its standard deviation.

    The error beyond the figures is common to all moves along one motion and independent between
    motions.

    Args:
        fitted: the fit.
        spread: errors of moves and days.
        rows: rows of the motions.

    Returns:
        Energy and standard deviation [J].
    """
    energy = fitted.arm.energy(rows)
    time = np.bincount(rows.group, rows.weight)
    variance = figures_variance(fitted, rows) + float(time @ time) * spread.move_sd**2
    for joint in np.flatnonzero(spread.session_sd).tolist():
        others = (np.arange(len(spread.session_sd)) != joint).astype(float)
        lost = energy - with_friction(fitted.arm, others).energy(rows)
        variance += (float(spread.session_sd[joint]) * lost) ** 2
    return energy, float(np.sqrt(variance))


def with_friction(arm: FittedArm, factor: Array) -> FittedArm:
    """The arm with its friction multiplied by a factor per joint (nq,) [1]."""
    parts = {name: getattr(arm, name) * factor for name in ("coulomb", "viscous", "load", "curved")}
    return replace(arm, **parts)


def figures_variance(fitted: FitResult, rows: Rows) -> float:
    """Variance [J²] of the energy due to errors of fitted figures and of the robot's own figures
    assumed for the fit."""
    by_rows = np.array([[arm.energy(rows)] for arm in fitted.row_error_arms])
    power, slope = fitted.arm.power(rows)
    gradient = rows.weight @ slope
    # the power parameters compensate an error of held friction in any motion, but no error of the
    # links, because its torque differs between motions
    arms = fitted.prior_error_arms if fitted.arm.link_change is not None else ()
    by_links = sum((arm.energy(rows) - float(rows.weight @ power)) ** 2 for arm in arms)
    return float(
        jackknife(by_rows)[0, 0] + gradient @ fitted.prior_covariance @ gradient + by_links
    )


def spread_of(fitted: FitResult, rows: Rows, threshold: float) -> Spread:
    """Spread of the moves and sessions of the fitted rows.

    Args:
        fitted: the fit.
        rows: rows of the fit.
        threshold: speed above which friction is measured [rad/s].
    """
    friction = MeasuredFriction.of(fitted.arm, rows, threshold)
    factors = np.array([friction.factor(rows.log == log) for log in np.unique(rows.log)])
    return Spread(_move_sd(fitted, rows, friction), session_sd(factors))


def _move_sd(fitted: FitResult, rows: Rows, friction: MeasuredFriction) -> float:
    """Standard deviation [W] of the mean error of a move beyond the errors of figures and days.

    A move is predicted by the arm fitted without the cluster of the move. With several logs, the
    friction is scaled to the other rows of the same log, because a difference between days is no
    error of the move.
    """
    measured = fitted.arm.measured_power(rows)
    use = np.isfinite(measured) & ~rows.rest
    days = len(np.unique(rows.log)) > 1
    squares, explained = list[float](), list[float]()
    for cluster in np.unique(fitted.clusters.of_row[use]):
        in_cluster = fitted.clusters.of_row == cluster
        for move in np.unique(rows.move[use & in_cluster]):
            chosen = use & in_cluster & (rows.move == move)
            part, arm = rows.take(chosen), fitted.arms_without_cluster[cluster]
            if days:
                factor = friction.factor((rows.log == part.log[0]) & ~in_cluster)
                arm = with_friction(arm, np.where(np.isfinite(factor), factor, 1.0))
            time = float(part.weight.sum())
            predicted, slope = arm.power(part)
            gradient = part.weight @ slope
            increase = float(gradient @ fitted.covariance_increase[cluster] @ gradient)
            squares.append((float(part.weight @ (measured[chosen] - predicted)) / time) ** 2)
            explained.append((figures_variance(fitted, part) + increase) / time**2)
    if not squares:
        return 0.0
    own = own_variance(np.array(squares), np.maximum(explained, 0.0))
    # few moves are a small sample: widened to the interval of Student's distribution
    return float(np.sqrt(own) * stdtrit(len(squares), 0.95) / P95)


def own_variance(squares: Array, explained: Array) -> float:
    """Variance τ² of errors beyond their explained variances.

    τ² solves Σ squares / (explained + τ²) = n, so errors with a large explained variance have
    little influence (Paule and Mandel 1982). A small share of the errors always counts as own.

    Args:
        squares: squared errors (n,).
        explained: explained variances (n,).
    """

    def excess(own: float) -> float:
        return float((squares / (explained + own)).sum()) - len(squares)

    least = INTERVAL.min_own_share * float(np.median(squares)) / INTERVAL.median_square
    if least <= 0 or excess(least) <= 0:
        return least
    return float(brentq(excess, least, float(squares.sum())))


def session_sd(factors: Array) -> Array:
    """Standard deviations of the friction of a day relative to the mean of the fitted logs.

    The mean of n logs has an error of its own, 1/n of the variance of a day. Few logs are a small
    sample, so the deviations are widened by Student's distribution.

    Args:
        factors: measured over fitted friction by log and joint, shape (logs, nq); NaN without a
            measurement.

    Returns:
        Relative standard deviations, shape (nq,) [1].
    """
    known = np.isfinite(factors)
    logs = known.sum(axis=0)
    found = np.full(factors.shape[1], INTERVAL.min_session_sd)
    for joint in np.flatnonzero(logs >= INTERVAL.min_sessions).tolist():
        spread = float(np.std(factors[known[:, joint], joint], ddof=1))
        wider = float(stdtrit(logs[joint] - 1, 0.95)) / P95
        found[joint] = max(found[joint], wider * spread)
    return np.asarray(found * np.sqrt(1 + 1 / np.maximum(logs, 1)))


@dataclass(frozen=True, eq=False)
class MeasuredFriction:
    """Products of measured and fitted friction torques per row and joint, shape (n, nq) [N²·m²].

    The products are 0 for slow joints and without a logged motor torque.
    """

    product: Array
    """Product of measured and fitted friction."""
    square: Array
    """Square of the fitted friction."""

    @classmethod
    def of(cls, arm: FittedArm, rows: Rows, threshold: float) -> MeasuredFriction:
        """Friction of the joints at speeds above `threshold` [rad/s]."""
        torque = arm.motor_torque(rows)
        use = np.isfinite(torque) & (np.abs(rows.v) > threshold)
        fitted = np.where(use, arm.friction_torque(rows) - arm.offset, 0.0)
        measured = np.where(use, torque - arm.link_torque(rows) - arm.offset, 0.0)
        return cls(fitted * measured, fitted**2)

    def factor(self, use: Mask) -> Array:
        """Least-squares ratio of measured to fitted friction per joint.

        Args:
            use: mask of the rows, shape (n,).

        Returns:
            Ratio, shape (nq,) [1]; NaN for a joint without a fast row.
        """
        product, square = self.product[use].sum(axis=0), self.square[use].sum(axis=0)
        return np.asarray(product / np.where(square > 0, square, np.nan))

    def mean_factor(self, use: Mask) -> float:
        """Least-squares ratio of measured to fitted friction over all joints [1]."""
        square = self.square[use].sum()
        return float(self.product[use].sum() / square) if square > 0 else np.nan
