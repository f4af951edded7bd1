"""Maximum likelihood from a periodic excitation (Swevers et al. 1997): the noise is measured, not
assumed.

The arm repeats a Fourier series, so that everything but noise repeats, too. The mean over periods
has less noise, and the spread over periods is the noise of each joint. With it as weights, least
squares is the maximum-likelihood estimate of Gaussian noise, and the covariance of the figures
follows without any residual.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.errors import MethodNotApplicable
from joulepath.optimizer.identify.estimates.estimate import Estimate
from joulepath.optimizer.identify.estimates.grouped import solve
from joulepath.optimizer.identify.fits.base_fit import base_arm, terms_of_arm
from joulepath.optimizer.identify.logs.log import Log, LogMove
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import MeasuredNoise
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows

_AVERAGED = ("q", "v", "a", "rigid", "links", "effort", "power", "temperature", "regressor")


@dataclass(frozen=True)
class PeriodicSettings:
    """What counts as a periodic log."""

    least_periods: int = 2
    """Periods of a log: the spread of fewer is not defined."""
    most_apart: float = 0.02
    """Largest distance of a joint from its mean position of all periods [rad]; far above the
    repeatability of arms."""


def periods_of(log: Log, period: float, settings: PeriodicSettings | None = None) -> Log:
    """The log cut into whole periods [s] from its first motion on, each of which counts as a move.

    Periods begin at the nearest sample. Raises MethodNotApplicable if there are too few, or if the
    motion differs.
    """
    settings = settings or PeriodicSettings()
    moving = [move for move in log.moves if not move.at_rest]
    start, end = (moving[0].start, moving[-1].end) if moving else (0, 0)
    length, rate = int(period * log.rate), log.rate
    count = round((end - start) / (period * rate))
    starts = [start + round(k * period * rate) for k in range(count)]
    starts = [each for each in starts if each + length <= len(log.time)]
    if len(starts) < settings.least_periods:
        raise MethodNotApplicable(
            "periodic",
            f"the log has {len(starts)} whole periods of {period:g} s, and at least "
            f"{settings.least_periods} are needed.",
        )
    q = np.array([log.q[each : each + length] for each in starts])
    apart = float(np.abs(q - q.mean(axis=0)).max())
    if apart > settings.most_apart:
        raise MethodNotApplicable(
            "periodic",
            f"its periods of {period:g} s are up to {apart:.2g} rad apart. Give the `period` of "
            "the "
            "motion, and log the same motion again and again.",
        )
    return replace(log, moves=tuple(LogMove(each, each + length, False) for each in starts))


def fit_periodic(
    robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions
) -> tuple[Estimate, MeasuredNoise]:
    """The most likely base parameters and friction from motor torques (n, nq) [N·m] of whole
    periods."""
    assert options.period is not None
    count = round((rows.time[-1] - rows.time[0]) / options.period)
    periods = torque.reshape(count, -1, robot.nq)
    noise = np.sqrt(periods.var(axis=0, ddof=1).mean(axis=0))
    mean = mean_period(rows, count)
    arm = base_arm(
        robot,
        mean,
        periods.mean(axis=0),
        Clusters(np.zeros(len(mean.q), dtype=np.int64), 1),
        options,
    )
    terms = terms_of_arm(robot, arm, options)
    deviation = np.maximum(noise[arm.block.joint], 1e-9) / np.sqrt(count)
    columns, values = terms.columns(arm) / deviation[:, None], arm.values / deviation
    gram = columns.T @ columns
    value = solve(gram, columns.T @ values, terms.lower)
    free = value > terms.lower
    covariance = np.zeros_like(gram)
    covariance[np.ix_(free, free)] = np.linalg.pinv(gram[np.ix_(free, free)], hermitian=True)
    residuals = values - columns @ value
    excess = float(residuals @ residuals / (len(values) - int(free.sum())))
    without = np.tile(value, (clusters.count, 1))
    estimate = Estimate(terms.names, value, without, ("",) * len(value), covariance)
    return estimate, MeasuredNoise(periods=count, deviation=noise, excess=excess)


def mean_period(rows: Rows, count: int) -> Rows:
    """The mean (n / count rows) of so many periods, which follow one another in the rows."""
    length = len(rows.q) // count
    first = rows.take(np.arange(len(rows.q)) < length)
    means = {name: getattr(rows, name) for name in _AVERAGED}
    return replace(
        first,
        **{
            name: each.reshape(count, length, *each.shape[1:]).mean(axis=0)
            for name, each in means.items()
        },
    )
