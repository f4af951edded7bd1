"""Maximum likelihood from a periodic excitation, with measured noise (Swevers et al. 1997).

The arm repeats a Fourier series, so everything but noise repeats. The mean over the periods has
less noise, and the spread over the periods is the noise of each joint. With the inverse noise as
weights, least squares is the maximum-likelihood estimate for Gaussian noise, and the covariance of
the figures follows without residuals.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.errors import MethodNotApplicable
from joulepath.optimizer.identify.estimates.estimate import Estimate
from joulepath.optimizer.identify.estimates.grouped import solve_bounded
from joulepath.optimizer.identify.fits.base_fit import (
    BaseTerms,
    base_regression,
    base_terms,
)
from joulepath.optimizer.identify.fits.block import TorqueData
from joulepath.optimizer.identify.fits.curve_speed import with_curve_speeds
from joulepath.optimizer.identify.fits.determined import with_reasons
from joulepath.optimizer.identify.fits.torque_fit import by_held_values, held_deviations
from joulepath.optimizer.identify.fits.whole_arm import WholeArmRegression
from joulepath.optimizer.identify.logs.log import Log, LogMove
from joulepath.optimizer.identify.results import MeasuredNoise
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows

_AVERAGED = ("q", "v", "a", "rigid", "link_torques", "effort", "power", "temperature", "regressor")


@dataclass(frozen=True)
class PeriodicSettings:
    """Settings of the method `periodic`."""

    min_periods: int = 2
    """Smallest number of periods of a log; one period has no spread."""
    max_deviation: float = 0.02
    """Largest distance of a joint from its mean position over all periods [rad]; far above the
    repeatability of arms."""
    min_noise: float = 1e-9
    """Smallest standard deviation of the torque of a row [N·m]."""


PERIODIC = PeriodicSettings()


def cut_into_periods(log: Log, period: float, settings: PeriodicSettings = PERIODIC) -> Log:
    """Cut a log into whole periods from its first motion on; each period counts as a move.

    Periods begin at the nearest sample.

    Args:
        log: log of a repeated motion.
        period: period of the motion [s].
        settings: requirements on the periods.

    Raises:
        MethodNotApplicable: there are too few periods, or the motion differs between periods.
    """
    moving = [move for move in log.moves if not move.at_rest]
    start, end = (moving[0].start, moving[-1].end) if moving else (0, 0)
    length, rate = int(period * log.rate), log.rate
    count = round((end - start) / (period * rate))
    starts = [start + round(k * period * rate) for k in range(count)]
    starts = [each for each in starts if each + length <= len(log.time)]
    if len(starts) < settings.min_periods:
        raise MethodNotApplicable(
            "periodic",
            f"the log has {len(starts)} whole periods of {period:g} s, and at least "
            f"{settings.min_periods} are needed.",
        )
    q = np.array([log.q[each : each + length] for each in starts])
    deviation = float(np.abs(q - q.mean(axis=0)).max())
    if deviation > settings.max_deviation:
        raise MethodNotApplicable(
            "periodic",
            f"its periods of {period:g} s are up to {deviation:.2g} rad apart. Give the `period` "
            "of the motion, and log the same motion again and again.",
        )
    return replace(log, moves=tuple(LogMove(each, each + length, False) for each in starts))


def fit_periodic(data: TorqueData) -> tuple[Estimate, MeasuredNoise]:
    """Maximum-likelihood estimate of base parameters and friction from rows of whole periods, and
    the measured noise."""
    robot, rows, options = data.robot, data.rows, data.options
    assert options.period is not None
    count = round((rows.time[-1] - rows.time[0]) / options.period)
    periods = data.torque.reshape(count, -1, robot.nq)
    noise = np.sqrt(periods.var(axis=0, ddof=1).mean(axis=0))
    mean = mean_period(rows, count)
    one = Clusters(np.zeros(len(mean.q), dtype=np.int64), 1)
    period = replace(data, rows=mean, torque=periods.mean(axis=0), clusters=one)
    measured = MeasuredNoise(periods=count, deviation=noise, excess=np.nan)

    def fit(speeds: Array | None) -> Estimate:
        nonlocal measured
        arm = base_regression(period, speeds)
        found, excess = _most_likely(base_terms(robot, arm, options), arm, measured, data.clusters)
        measured = replace(measured, excess=excess)
        return found

    return with_curve_speeds(fit, period), measured


def _most_likely(
    terms: BaseTerms, arm: WholeArmRegression, noise: MeasuredNoise, clusters: Clusters
) -> tuple[Estimate, float]:
    """Most likely unknowns, and the mean square of the residuals over that of the noise.

    Undetermined friction and rotors are held at the robot's own values, the least determined first.
    """
    deviation = np.maximum(noise.deviation[arm.block.joint], PERIODIC.min_noise)
    deviation = deviation / np.sqrt(noise.periods)
    columns, own = terms.columns(arm) / deviation[:, None], terms.own
    free, reasons = np.ones(len(own), dtype=bool), [""] * len(own)
    while True:
        kept = arm.block.kept_torque(terms.names_of(~free))
        values = (arm.values - kept) / deviation - columns[:, ~free] @ own[~free]
        part, value = columns[:, free], own.copy()
        value[free] = solve_bounded(part.T @ part, part.T @ values, terms.lower[free])
        inside = free & (value > terms.lower)
        part = columns[:, inside]
        covariance = np.zeros((len(own), len(own)))
        covariance[np.ix_(inside, inside)] = np.linalg.pinv(part.T @ part, hermitian=True)
        sd = np.sqrt(np.diag(covariance))
        doubts = terms.doubts(value, value, sd, free & terms.of_joints)
        if doubts.worst is None:
            break
        free[doubts.worst], reasons[doubts.worst] = False, doubts.reasons[doubts.worst]
    residuals = values - columns[:, free] @ value[free]
    excess = float(residuals @ residuals / (len(values) - int(inside.sum())))
    held = held_deviations(arm.block, terms.names, terms.names_of(~free))
    covariance += by_held_values(columns.T @ columns, inside, held)
    without = np.tile(value, (clusters.count, 1))
    found = Estimate(terms.names, value, without, tuple(reasons), covariance, doubts.remarks)
    return with_reasons(found, np.flatnonzero(~terms.of_joints).tolist()), excess


def mean_period(rows: Rows, count: int) -> Rows:
    """Mean (n / count rows) over consecutive periods.

    Args:
        rows: rows of whole periods.
        count: number of periods.
    """
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
