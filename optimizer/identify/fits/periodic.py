"""Maximum likelihood from a periodic excitation (Swevers et al. 1997): the noise is measured, not assumed.

The arm repeats a Fourier series, so that everything but noise repeats, too. The mean over periods has less noise, and
the spread over periods is the noise of each joint. With it as weights, least squares is the maximum-likelihood estimate
of Gaussian noise, and the covariance of the figures follows without any residual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem

LEAST_PERIODS = 2


@dataclass(frozen=True, eq=False)
class Period:
    """The mean period of a signal (m, k), and the variance (k,) of the noise of a single sample."""

    mean: Array
    variance: Array
    periods: int


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The most likely figures (p,) and their covariance (p, p). `excess` is the mean square of the residuals over that
    of the measured noise: 1 if the model is right, more if it misses something."""

    value: Array
    covariance: Array
    excess: float


def mean_period(signal: Array, samples: int) -> Period:
    """The mean period of a signal (n, k) that repeats every `samples` rows. Raises InvalidProblem below two periods."""
    periods = len(signal) // samples
    if periods < LEAST_PERIODS:
        raise InvalidProblem("logs", f"The log has {periods} whole periods: at least {LEAST_PERIODS} are needed.")
    parts = signal[: periods * samples].reshape(periods, samples, -1)
    return Period(parts.mean(axis=0), parts.var(axis=0, ddof=1).mean(axis=0), periods)


def most_likely(regressor: Array, measured: Period) -> Likelihood:
    """The most likely figures for torques (m, nq) that are `regressor` (m, nq, p) times them, and noise."""
    deviation = np.sqrt(np.maximum(measured.variance, 1e-300) / measured.periods)
    columns = (regressor / deviation[:, None]).reshape(-1, regressor.shape[2])
    values = (measured.mean / deviation).ravel()
    value, *_ = np.linalg.lstsq(columns, values, rcond=None)
    covariance = np.linalg.inv(columns.T @ columns)
    residuals = values - columns @ value
    return Likelihood(
        np.asarray(value), np.asarray(covariance), float(residuals @ residuals / (len(values) - len(value)))
    )
