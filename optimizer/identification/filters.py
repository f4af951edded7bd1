"""Zero-phase low-pass filter, derivatives and noise of a log's channels."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

from models.robot import Array

HIGHEST_CUTOFF = 20.0
"""Cut-off [Hz] of the filter at most: arms move more slowly than that."""
_LEAST_RATIO = 5.0  # rate / cut-off at least
_ORDER = 2  # of the filter, which runs forwards and backwards
_ROBUST = 1.4826  # standard deviation / median absolute deviation of a normal distribution


def cutoff(rate: float) -> float:
    """Cut-off frequency [Hz] for a rate [Hz]."""
    return min(HIGHEST_CUTOFF, rate / _LEAST_RATIO)


def low_passed(values: Array, rate: float) -> Array:
    """Channels (n, k) without what is above the cut-off, and without delay: a Butterworth filter, both ways."""
    sections = butter(_ORDER, cutoff(rate), fs=rate, output="sos")
    smooth = np.empty_like(values)
    # one channel at a time: the filter copies what it is given
    for k, channel in enumerate(values.T):
        smooth[:, k] = sosfiltfilt(sections, channel)
    return smooth


def derivative(values: Array, rate: float) -> Array:
    """Rates of change (n, k) of the low-passed channels (n, k), by central differences."""
    return np.gradient(low_passed(values, rate), 1 / rate, axis=0)


def noise(values: Array, rate: float) -> Array:
    """Robust standard deviation (k,) of what is above the cut-off in channels (n, k)."""
    return np.array([_noise(channel, rate) for channel in values.T])


def _noise(channel: Array, rate: float) -> float:
    above = channel - low_passed(channel[:, None], rate)[:, 0]
    above -= np.median(above)
    return float(_ROBUST * np.median(np.abs(above)))
