"""Zero-phase low-pass filter, derivatives and noise of a log's channels."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array

HIGHEST_CUTOFF = 20.0
"""Cut-off [Hz] of the filter at most: arms move more slowly than that."""
CUTOFFS = (80.0, 40.0)
"""Cut-offs [Hz] of derivatives where the noise is small, the highest first."""
_CLEAN = 0.05  # share of the second derivative that may be noise
_LEAST_RATIO = 5.0  # rate / cut-off at least
_ORDER = 2  # of the filter, which runs forwards and backwards
_ROBUST = 1.4826  # standard deviation / median absolute deviation of a normal distribution


def cutoff(rate: float) -> float:
    """Cut-off frequency [Hz] for a rate [Hz]."""
    return min(HIGHEST_CUTOFF, rate / _LEAST_RATIO)


def low_passed(values: Array, rate: float) -> Array:
    """Channels (n, k) without what is above the cut-off, and without delay: a Butterworth filter,
    both ways.
    """
    smooth = np.empty_like(values)
    # one channel at a time: the filter copies what it is given
    for k, channel in enumerate(values.T):
        smooth[:, k] = filtered(channel, rate, cutoff(rate))
    return smooth


def filtered(channel: Array, rate: float, highest: float) -> Array:
    """A channel (n,) without what is above a frequency [Hz]."""
    # every process that serves requests would hold 25 MB of it, and only logs are filtered
    from scipy.signal import butter, sosfiltfilt

    return np.asarray(sosfiltfilt(butter(_ORDER, highest, fs=rate, output="sos"), channel))


def derivative(values: Array, rate: float) -> Array:
    """Rates of change (n, k) of the low-passed channels (n, k), by central differences.

    The cut-off is the highest at which the noise leaves even the second derivative as it is: a low
    one flattens the accelerations of fast moves.
    """
    rates = np.empty_like(values)
    for k, channel in enumerate(values.T):
        smooth = filtered(channel, rate, _clean_cutoff(channel, rate))
        rates[:, k] = np.gradient(smooth, 1 / rate)
    return rates


def _clean_cutoff(channel: Array, rate: float) -> float:
    """The highest of the cut-offs [Hz] that the noise allows in a channel (n,)."""
    lowest = cutoff(rate)
    for highest in CUTOFFS:
        if lowest < highest <= rate / _LEAST_RATIO:
            smooth = filtered(channel, rate, highest)
            above = float(_ROBUST * np.median(np.abs(channel - smooth)))
            second = np.gradient(np.gradient(smooth, 1 / rate), 1 / rate)
            # of noise that is the same at all frequencies, what is below the cut-off,
            # differentiated twice
            share = 2 * highest**5 / (5 * (rate - 2 * highest))
            if (2 * np.pi) ** 2 * above * np.sqrt(share) < _CLEAN * second.std():
                return highest
    return lowest


def noise(values: Array, rate: float) -> Array:
    """Robust standard deviation (k,) of what is above the cut-off in channels (n, k)."""
    return np.array([_noise(channel, rate) for channel in values.T])


def _noise(channel: Array, rate: float) -> float:
    above = channel - low_passed(channel[:, None], rate)[:, 0]
    above -= np.median(above)
    return float(_ROBUST * np.median(np.abs(above)))
