"""Interval of a predicted energy: errors of the figures, of the move and of the day.

The covariance of the figures alone is far too narrow. Every move has an error that no figures of
the model can express, and friction differs from day to day. Both errors are measured: the first
with moves left out of the fit, the second with logs of different days.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from joulepath.models.robot import Array
from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.logged_torque import motor_torque
from joulepath.optimizer.identify.estimates.grouped import jackknife
from joulepath.optimizer.identify.fits.fitting import FitResult
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class IntervalSettings:
    """Settings of the interval of a predicted energy."""

    default_session_sd: float = 0.03
    """Relative standard deviation of friction from day to day if there are few logs [1]: 2 to 4 %
    in twelve logs of a UR10e over two months."""
    min_sessions: int = 3
    """Logs below which the default is taken."""
    min_own_share: float = 0.1
    """Smallest share of the moves' own errors in the square of their mean errors [1]."""
    median_square: float = 0.455
    """Median of the square of a standard normal variable [1]."""


INTERVAL = IntervalSettings()


@dataclass(frozen=True)
class Spread:
    """Errors that the figures of the model do not express."""

    move_sd: float
    """Standard deviation of the mean power of a move [W]."""
    session_sd: float
    """Relative standard deviation of friction between days [1]."""


def energy_sd(fitted: FitResult, spread: Spread, rows: Rows) -> tuple[float, float]:
    """Predicted energy of rows and its standard deviation [J]."""
    energy = fitted.arm.energy(rows)
    time = float(rows.weight.sum())
    session = spread.session_sd * (without_friction(fitted.arm).energy(rows) - energy)
    variance = figures_variance(fitted, rows) + (time * spread.move_sd) ** 2 + session**2
    return energy, float(np.sqrt(variance))


def without_friction(arm: FittedArm) -> FittedArm:
    """The arm without friction."""
    zero = np.zeros_like(arm.coulomb)
    return replace(arm, coulomb=zero, viscous=zero, load=zero, curved=zero, couplings=())


def figures_variance(fitted: FitResult, rows: Rows) -> float:
    """Variance [J²] of the energy due to errors of fitted figures and of the robot's own figures
    assumed for the fit."""
    by_rows = np.array([[arm.energy(rows)] for arm in fitted.row_error_arms])
    power, slope = fitted.arm.power(rows)
    gradient = rows.weight @ slope
    # the power parameters compensate an error of held friction in any motion, but not an error of
    # the links, which load other motions differently
    arms = fitted.prior_error_arms if fitted.arm.link_change is not None else ()
    by_links = sum((arm.energy(rows) - float(rows.weight @ power)) ** 2 for arm in arms)
    return float(
        jackknife(by_rows)[0, 0] + gradient @ fitted.prior_covariance @ gradient + by_links
    )


def spread_of(fitted: FitResult, rows: Rows) -> Spread:
    """Spread of the moves and sessions of the fitted rows."""
    return Spread(_move_sd(fitted, rows), session_sd(session_factors(fitted, rows)))


def _move_sd(fitted: FitResult, rows: Rows) -> float:
    """Standard deviation [W] of the mean error of a move beyond the errors of the figures.

    Each move is predicted by the arm fitted without its cluster.
    """
    use = np.isfinite(rows.power) & ~rows.rest
    squares, explained = list[float](), list[float]()
    for cluster in np.unique(fitted.clusters.of_row[use]):
        in_cluster = use & (fitted.clusters.of_row == cluster)
        for move in np.unique(rows.move[in_cluster]):
            part = rows.take(in_cluster & (rows.move == move))
            time = float(part.weight.sum())
            predicted, slope = fitted.arms_without_cluster[cluster].power(part)
            gradient = part.weight @ slope
            increase = float(gradient @ fitted.covariance_increase[cluster] @ gradient)
            squares.append((float(part.weight @ (part.power - predicted)) / time) ** 2)
            explained.append((figures_variance(fitted, part) + increase) / time**2)
    if not squares:
        return 0.0
    own = own_variance(np.array(squares), np.maximum(explained, 0.0))
    # few moves are a small sample: the interval is as wide as that of Student's distribution
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


def session_factors(fitted: FitResult, rows: Rows) -> tuple[float, ...]:
    """Friction of each log over the fitted friction, from torques of the motors; empty without
    these."""
    effort = motor_torque(fitted.arm, rows)
    friction = fitted.arm.friction_torque(rows) - fitted.arm.offset
    rest = effort - fitted.arm.link_torque(rows) - fitted.arm.offset
    use = np.isfinite(effort)
    factors = list[float]()
    for log in np.unique(rows.log):
        chosen = use & (rows.log == log)[:, None]
        square = float((friction[chosen] ** 2).sum())
        if square > 0:
            factors.append(float((friction[chosen] * rest[chosen]).sum() / square))
    return tuple(factors)


def session_sd(factors: tuple[float, ...]) -> float:
    """Relative standard deviation of friction between logs; a default for few logs."""
    if len(factors) < INTERVAL.min_sessions:
        return INTERVAL.default_session_sd
    return float(np.std(factors, ddof=1))
