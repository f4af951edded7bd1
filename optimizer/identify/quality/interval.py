"""The interval of an energy: from the figures' covariance, the effect of the move and that of the
day.

The figures' covariance alone is far too narrow. A move has an error of its own that no figures of
this model can express, and friction differs from day to day. Both are measured: the first on moves
that were left out of the fit, the second on logs of different days.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from joulepath.models.robot import Array
from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.estimates.grouped import jackknife
from joulepath.optimizer.identify.fits.fitting import Fitted
from joulepath.optimizer.identify.rows.fit_rows import Rows

# relative standard deviation of friction from day to day, where there are too few logs to measure
# it: 2 to 4 % in twelve logs of a UR10e over two months
SESSION = 0.03
LEAST_SESSIONS = 3
# share of the square of the moves' mean errors that is their own at least
LEAST_OWN = 0.1
# median of the square of a normal error over its variance
MEDIAN_SQUARE = 0.455


@dataclass(frozen=True)
class Spread:
    """`move` [W]: standard deviation of the mean power of a move. `session` [1]: relative, of
    friction between days.
    """

    move: float
    session: float


def energy_sd(fitted: Fitted, spread: Spread, rows: Rows) -> tuple[float, float]:
    """Energy [J] of rows on the bus, and its standard deviation [J]."""
    energy = _energy(fitted.arm, rows)
    time = float(rows.weight.sum())
    session = spread.session * (_energy(without_friction(fitted.arm), rows) - energy)
    variance = figures_variance(fitted, rows) + (time * spread.move) ** 2 + session**2
    return energy, float(np.sqrt(variance))


def _energy(arm: FittedArm, rows: Rows) -> float:
    return float(rows.weight @ arm.power(rows)[0])


def without_friction(arm: FittedArm) -> FittedArm:
    """The arm without friction."""
    zero = np.zeros_like(arm.coulomb)
    return replace(arm, coulomb=zero, viscous=zero, load=zero, curved=zero, couplings=())


def figures_variance(fitted: Fitted, rows: Rows) -> float:
    """Variance [J²] of the energy by the errors of the figures: those of the fit, and of the
    robot's own beneath it.
    """
    without = np.array([[_energy(arm, rows)] for arm in fitted.varied])
    power, slope = fitted.arm.power(rows)
    gradient = rows.weight @ slope
    # what the electrics make of an error of held friction, they make up for in the energy; links
    # load other motions otherwise
    tilted = fitted.tilted if fitted.arm.bodies is not None else ()
    by_links = sum((_energy(arm, rows) - float(rows.weight @ power)) ** 2 for arm in tilted)
    return float(jackknife(without)[0, 0] + gradient @ fitted.drift @ gradient + by_links)


def spread_of(fitted: Fitted, rows: Rows) -> Spread:
    """From the rows of the fit: each move is predicted by the figures without its cluster."""
    return Spread(_move_sd(fitted, rows), session_sd(sessions(fitted, rows)))


def _move_sd(fitted: Fitted, rows: Rows) -> float:
    """Standard deviation [W] of the mean error of a move, less what the figures' own errors make of
    it.
    """
    use = np.isfinite(rows.power) & ~rows.rest
    squares, explained = list[float](), list[float]()
    for cluster in np.unique(fitted.clusters.of_row[use]):
        for move in np.unique(rows.move[use & (fitted.clusters.of_row == cluster)]):
            part = rows.take(use & (rows.move == move) & (fitted.clusters.of_row == cluster))
            time = float(part.weight.sum())
            blind, slope = fitted.without[cluster].power(part)
            gradient = part.weight @ slope
            lost = float(gradient @ fitted.lost[cluster] @ gradient)
            squares.append((float(part.weight @ (part.power - blind)) / time) ** 2)
            explained.append((figures_variance(fitted, part) + lost) / time**2)
    if not squares:
        return 0.0
    own = own_variance(np.array(squares), np.maximum(explained, 0.0))
    # of few moves, as wide as Student's distribution is
    return float(np.sqrt(own) * stdtrit(len(squares), 0.95) / P95)


def own_variance(squares: Array, explained: Array) -> float:
    """The variance τ² that errors have besides `explained` variances (n,), from their `squares`
    (n,).

    Σ squares / (explained + τ²) = n: an error that can be explained by much tells little of τ²
    (Paule and Mandel 1982). A small share of the errors is their own at least.
    """

    def excess(own: float) -> float:
        return float((squares / (explained + own)).sum()) - len(squares)

    least, most = LEAST_OWN * float(np.median(squares)) / MEDIAN_SQUARE, float(squares.sum())
    if least <= 0 or excess(least) <= 0:
        return least
    return float(brentq(excess, least, most))


def sessions(fitted: Fitted, rows: Rows) -> tuple[float, ...]:
    """The size of each log's friction relative to the fit's, from its torques; empty without
    torques.
    """
    effort = rows.effort * fitted.arm.torque_constant if rows.current else rows.effort
    friction = fitted.arm.friction_torque(rows) - fitted.arm.offset
    rest = effort - fitted.arm.link_torque(rows) - fitted.arm.offset
    use = np.isfinite(effort)
    found = list[float]()
    for log in np.unique(rows.log):
        chosen = use & (rows.log == log)[:, None]
        square = float((friction[chosen] ** 2).sum())
        if square > 0:
            found.append(float((friction[chosen] * rest[chosen]).sum() / square))
    return tuple(found)


def session_sd(found: tuple[float, ...]) -> float:
    """Relative standard deviation of friction between logs; the usual one where there are too few
    of them.
    """
    return float(np.std(found, ddof=1)) if len(found) >= LEAST_SESSIONS else SESSION
