"""Lag of efforts or power behind the motion, caused by another clock or a filter of the driver.

A late effort coincides with wrong accelerations and misses the reversals of friction. The figures
would be wrong, and their standard deviations would not show it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.identify.logs.motion import LoggedMotion, thinned


@dataclass(frozen=True)
class LagSettings:
    """Settings of the search for lags."""

    min_lag: float = 0.02
    """Smallest lag that is corrected [s]; filters of controllers have some milliseconds."""
    max_lag: float = 0.2
    """Largest lag [s]."""
    max_rows: int = 4000
    """Approximate largest number of compared rows."""
    min_rows: int = 50
    """Smallest number of compared rows of a joint."""
    steps: int = 20
    """Steps of the coarse and of the fine search on either side."""
    min_speed: float = 0.02
    """Speed below which rows are not compared [rad/s]: they show the onset of friction rather than
    the time."""
    blocks: int = 10
    """Parts of the log that are left out in turn for the standard deviation of the lag."""
    min_deviations: float = 4.0
    """Standard deviations that a lag must exceed."""
    max_error_ratio: float = 0.997
    """Squared error with the lag over that without it, above which there is no lag [1]."""
    min_error_share: float = 1e-6
    """Unexplained share of the squared channel, below which all is explained [1]."""
    half_window: float = 0.01
    """Time on either side of a sample over which channels are averaged [s]."""
    spike_neighbours: int = 5
    """Samples of the median that detects spikes."""
    spike_share: float = 0.3
    """Distance of a spike from the median of its neighbours over the range of the channel [1]."""


LAG = LagSettings()


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel to be explained by a motion."""

    values: Array
    """Values of all rows of the log (n,)."""
    rows: Indices
    """Compared rows (k,)."""
    columns: Array
    """Regressors of the motion at the compared rows (k, p)."""
    blocks: Indices
    """Part of the log of each compared row (k,)."""


def effort_lag(motion: LoggedMotion, effort: Array) -> float:
    """Lag of efforts behind the motion.

    Args:
        motion: the motion.
        effort: efforts (n, joints).

    Returns:
        The lag [s], negative if the efforts come first; 0 if it is short, or not the same in all
        parts of the log.
    """
    rows = _compared_rows(len(effort), motion.rate)
    if len(rows) < LAG.min_rows:
        return 0.0
    blocks = np.arange(len(rows)) * LAG.blocks // len(rows)
    part = motion.at(rows)
    rigid, channels = part.rigid_torques(), list[_Channel]()
    for joint in range(effort.shape[1]):
        use = np.abs(part.v[:, joint]) > LAG.min_speed
        values = smooth(without_spikes(effort[:, joint]), motion.rate)
        if use.sum() >= LAG.min_rows and np.ptp(values) > 0:
            load, speed, sign = rigid[use, joint], part.v[use, joint], np.sign(part.v[use, joint])
            columns = [
                load,
                part.a[use, joint],
                sign,
                np.abs(load) * sign,
                speed,
                np.ones_like(speed),
            ]
            channels.append(_Channel(values, rows[use], np.stack(columns, axis=1), blocks[use]))
    return _common_lag(channels, motion.rate)


def power_lag(motion: LoggedMotion, power: Array) -> float:
    """Lag of power (n,) behind the motion [s], as `effort_lag`."""
    rows = _compared_rows(len(power), motion.rate)
    part, drives = motion.at(rows), motion.robot.drives
    # at rest, the noise of the speeds would explain that of the power at some lag
    moving = (np.abs(part.v) > LAG.min_speed).any(axis=1)
    if moving.sum() < LAG.min_rows or not np.ptp(power):
        return 0.0
    rigid = part.rigid_torques()
    torque = rigid + drives.rotor_inertia * part.a
    drag = motion.robot.friction.torque(part.v, rigid)
    heat = drives.copper / drives.torque_constant**2
    parts = [
        torque * part.v,
        drag * part.v,
        heat * torque**2,
        heat * torque * drag,
        heat * part.v**2,
    ]
    columns = np.column_stack([*(each.sum(axis=1) for each in parts), np.ones(len(rows))])
    blocks = np.arange(len(rows)) * LAG.blocks // len(rows)
    values = smooth(without_spikes(power), motion.rate)
    return _common_lag([_Channel(values, rows, columns, blocks)], motion.rate)


def _max_shift(rate: float) -> int:
    """Rows of the largest lag."""
    return max(2, round(LAG.max_lag * rate))


def _compared_rows(count: int, rate: float) -> Indices:
    """Compared rows of a log, at least the largest lag away from its ends."""
    return thinned(count, LAG.max_rows, _max_shift(rate))


def _common_lag(channels: Sequence[_Channel], rate: float) -> float:
    """The lag of all channels together [s]."""
    edge, steps = _max_shift(rate), LAG.steps
    step = max(1, edge // steps)
    coarse = np.arange(-(edge // step), edge // step + 1) * step
    error = _log_errors(channels, coarse)[0]
    best, unshifted = int(np.argmin(error)), len(coarse) // 2
    if best in (0, len(error) - 1) or error[best] - error[unshifted] > np.log(LAG.max_error_ratio):
        return 0.0
    fine = int(coarse[best]) + np.arange(-steps, steps + 1) * max(1, step // steps)
    fine = fine[np.abs(fine) <= edge]
    lags = np.array([_minimum(fine, each) for each in _log_errors(channels, fine)]) / rate
    lag, parts = float(lags[0]), lags[1:]
    return lag if abs(lag) >= max(LAG.min_lag, LAG.min_deviations * jackknife_sd(parts)) else 0.0


def jackknife_sd(parts: Array) -> float:
    """Jackknife standard deviation from the values (blocks,) with one block left out."""
    return float(np.sqrt((len(parts) - 1) / len(parts) * ((parts - parts.mean()) ** 2).sum()))


def _minimum(shifts: Indices, error: Array) -> float:
    """Minimum of the parabola through the least error and its neighbours [rows]."""
    best = int(np.clip(np.argmin(error), 1, len(error) - 2))
    before, here, after = error[best - 1 : best + 2]
    between = float(
        np.clip(0.5 * (before - after) / max(before - 2 * here + after, 1e-300), -0.5, 0.5)
    )
    return float(shifts[best] + between * (shifts[1] - shifts[0]))


def _log_errors(channels: Sequence[_Channel], shifts: Indices) -> Array:
    """Logarithm of the unexplained share of the squared channels, averaged over the channels.

    Args:
        channels: the channels.
        shifts: numbers of rows by which the channels come later.

    Returns:
        The logarithm (blocks + 1, shifts): for all rows, and without one block each.
    """
    found = [np.zeros((LAG.blocks + 1, len(shifts)))]
    for channel in channels:
        shifted = channel.values[channel.rows[:, None] + shifts].astype(float)
        basis = np.linalg.svd(channel.columns, full_matrices=False)[0]
        centred = shifted - shifted.mean(axis=0)
        error = centred - basis @ (basis.T @ centred)
        squares, errors = (_without_blocks(each**2, channel.blocks) for each in (centred, error))
        share = np.maximum(errors / np.maximum(squares, 1e-300), LAG.min_error_share)
        found.append(np.log(share))
    return np.asarray(np.mean(found[1:] or found, axis=0))


def _without_blocks(squares: Array, blocks: Indices) -> Array:
    """Sums (blocks + 1, k) of squares (n, k): of all rows, and without one block each."""
    parts = np.zeros((LAG.blocks, squares.shape[1]))
    np.add.at(parts, blocks, squares)
    total = parts.sum(axis=0)
    return np.vstack([total, total - parts])


def without_spikes(channel: Array) -> Array:
    """A channel (n,) with spikes replaced by the median of their neighbours."""
    # imported late: only logs are filtered, and every serving process would hold it
    from scipy.ndimage import median_filter

    middle = median_filter(channel, LAG.spike_neighbours)
    low, high = np.percentile(middle, [2, 98])
    spike = np.abs(channel - middle) > LAG.spike_share * (high - low)
    return np.asarray(np.where(spike, middle, channel))


def smooth(channel: Array, rate: float) -> Array:
    """Moving average of a channel (n,)."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(channel, 2 * round(LAG.half_window * rate) + 1))
