"""Zero-phase low-pass filter, derivatives and noise of the channels of a log."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from joulepath.models.robot import Array

MAD_TO_SD = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""


@dataclass(frozen=True)
class FilterSettings:
    """Settings of the low-pass filters."""

    max_cutoff: float = 20.0
    """Largest cut-off frequency [Hz]; arms move more slowly."""
    derivative_cutoffs: tuple[float, ...] = (80.0, 40.0)
    """Cut-off frequencies of derivatives of channels with little noise, the highest first [Hz]."""
    max_noise_share: float = 0.05
    """Share of noise in a second derivative, up to which a channel has little noise [1]."""
    min_rate_ratio: float = 5.0
    """Smallest ratio of rate to cut-off frequency [1]."""
    order: int = 2
    """Order of the Butterworth filter, applied forwards and backwards."""


FILTERS = FilterSettings()


def cutoff(rate: float) -> float:
    """Cut-off frequency [Hz] of the low-pass filter for a rate [Hz]."""
    return min(FILTERS.max_cutoff, rate / FILTERS.min_rate_ratio)


def low_passed(values: Array, rate: float) -> Array:
    """Channels (n, k) without frequencies above the cut-off and without delay."""
    smooth = np.empty_like(values)
    # one channel at a time: the filter copies its input
    for k, channel in enumerate(values.T):
        smooth[:, k] = filtered(channel, rate, cutoff(rate))
    return smooth


def filtered(channel: Array, rate: float, max_frequency: float) -> Array:
    """A channel (n,) without frequencies above a limit [Hz]: a Butterworth filter, both ways."""
    # imported late: only logs are filtered, and every serving process would hold 25 MB of it
    from scipy.signal import sosfiltfilt

    return np.asarray(sosfiltfilt(_sections(rate, max_frequency), channel))


@lru_cache
def _sections(rate: float, max_frequency: float) -> Array:
    """Second-order sections of the filter; to design them takes as long as to filter a log."""
    from scipy.signal import butter

    return np.asarray(butter(FILTERS.order, max_frequency, fs=rate, output="sos"))


def derivative(values: Array, rate: float) -> Array:
    """Derivatives (n, k) of low-passed channels (n, k), by central differences.

    The cut-off frequency is the highest at which the noise is small even in the second derivative:
    a low cut-off flattens the accelerations of fast moves.
    """
    rates = np.empty_like(values)
    for k, channel in enumerate(values.T):
        smooth = filtered(channel, rate, _clean_cutoff(channel, rate))
        rates[:, k] = np.gradient(smooth, 1 / rate)
    return rates


def _clean_cutoff(channel: Array, rate: float) -> float:
    """The highest cut-off frequency [Hz] that the noise of a channel (n,) allows."""
    lowest = cutoff(rate)
    for highest in FILTERS.derivative_cutoffs:
        if lowest < highest <= rate / FILTERS.min_rate_ratio:
            smooth = filtered(channel, rate, highest)
            above = float(MAD_TO_SD * np.median(np.abs(channel - smooth)))
            second = np.gradient(np.gradient(smooth, 1 / rate), 1 / rate)
            # power of white noise below the cut-off in the second derivative, over its power above
            share = 2 * highest**5 / (5 * (rate - 2 * highest))
            noise_of_second = (2 * np.pi) ** 2 * above * np.sqrt(share)
            if noise_of_second < FILTERS.max_noise_share * second.std():
                return highest
    return lowest


def noise(values: Array, rate: float) -> Array:
    """Robust standard deviation (k,) of the part of channels (n, k) above the cut-off frequency."""
    return np.array([_noise(channel, rate) for channel in values.T])


def _noise(channel: Array, rate: float) -> float:
    above = channel - low_passed(channel[:, None], rate)[:, 0]
    above -= np.median(above)
    return float(MAD_TO_SD * np.median(np.abs(above)))
