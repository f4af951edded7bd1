"""By how much the efforts or the power of a log come later than its motion: another clock, or a
filter of the driver's.

An effort that comes late falls into wrong accelerations and beside the turns of the friction. The
figures would be wrong, and their standard deviations would not tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.identify.logs.motion import Motion, thinned

LEAST_LAG = 0.02
"""Shorter lags [s] are left as they are: controllers' own filters have some milliseconds."""
_MOST_LAG = 0.2  # s that is sought
_MOST_ROWS, _STEPS = 4000, 20
_LEAST_SPEED = 0.02  # rad/s of the rows that are compared
_LEAST_ROWS = 50  # of a joint
_BLOCKS, _SDS = (
    10,
    4.0,
)  # parts of the log that are left out in turn, and standard deviations of a lag that is told
_MOST_LEFT = (
    0.997  # share of the square of the misfit that the lag leaves of it: what leaves more is no lag
)
_LEAST_SHARE = 1e-6  # below it, all is explained
_AVERAGE = 0.01  # s before and behind, of efforts that are compared
_NEIGHBOURS, _FAR = (
    5,
    0.3,
)  # of the range of an effort that it is off its neighbours' median: a spike


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel (n,) of a log, of which the motion explains what the `columns` (k, p) span, at the
    rows (k,).
    """

    values: Array
    rows: Indices
    columns: Array
    blocks: Indices


def lag_of(motion: Motion, effort: Array) -> float:
    """The time [s] by which efforts (n, joints) come after the motion, negative if before.

    0 where it is short, or where the parts of the log do not agree on it."""
    rows = _compared(len(effort), motion.rate)
    if len(rows) < _LEAST_ROWS:
        return 0.0
    blocks = np.arange(len(rows)) * _BLOCKS // len(rows)
    part = motion.at(rows)
    rigid, channels = part.rigid_torques(), list[_Channel]()
    for joint in range(effort.shape[1]):
        # slower ones say more of how friction begins than of when
        use = np.abs(part.v[:, joint]) > _LEAST_SPEED
        values = smooth(without_spikes(effort[:, joint]), motion.rate)
        if use.sum() >= _LEAST_ROWS and np.ptp(values) > 0:
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
    return _lag(channels, motion.rate)


def power_lag_of(motion: Motion, power: Array) -> float:
    """The time [s] by which the power (n,) comes after the motion, as `lag_of` says."""
    rows = _compared(len(power), motion.rate)
    if len(rows) < _LEAST_ROWS or not np.ptp(power):
        return 0.0
    part, drives = motion.at(rows), motion.robot.drives
    rigid = part.rigid_torques()
    torque, drag = (
        rigid + drives.rotor_inertia * part.a,
        motion.robot.friction.torque(part.v, rigid),
    )
    heat = drives.copper / drives.torque_constant**2
    parts = [
        torque * part.v,
        drag * part.v,
        heat * torque**2,
        heat * torque * drag,
        heat * part.v**2,
    ]
    columns = np.column_stack([*(each.sum(axis=1) for each in parts), np.ones(len(rows))])
    blocks = np.arange(len(rows)) * _BLOCKS // len(rows)
    return _lag(
        [_Channel(smooth(without_spikes(power), motion.rate), rows, columns, blocks)], motion.rate
    )


def _compared(count: int, rate: float) -> Indices:
    """The rows of a log of so many that are compared: others can be as far from them as the longest
    lag.
    """
    edge = max(2, round(_MOST_LAG * rate))
    return thinned(count, _MOST_ROWS, edge)


def _lag(channels: Sequence[_Channel], rate: float) -> float:
    """The lag [s] of all channels together."""
    edge = max(2, round(_MOST_LAG * rate))
    step = max(1, edge // _STEPS)
    coarse = np.arange(-(edge // step), edge // step + 1) * step
    left = _left(channels, coarse)[0]
    best, none = int(np.argmin(left)), len(coarse) // 2
    if best in (0, len(left) - 1) or left[best] - left[none] > np.log(_MOST_LEFT):
        return 0.0
    fine = int(coarse[best]) + np.arange(-_STEPS, _STEPS + 1) * max(1, step // _STEPS)
    fine = fine[np.abs(fine) <= edge]
    least = np.array([_least(fine, each) for each in _left(channels, fine)]) / rate
    lag, parts = float(least[0]), least[1:]
    sd = np.sqrt((_BLOCKS - 1) / _BLOCKS * float(((parts - parts.mean()) ** 2).sum()))
    return lag if abs(lag) >= max(LEAST_LAG, _SDS * sd) else 0.0


def _least(shifts: Indices, left: Array) -> float:
    """Where the parabola through the least value and its neighbours is least, in rows."""
    best = int(np.clip(np.argmin(left), 1, len(left) - 2))
    before, here, after = left[best - 1 : best + 2]
    between = float(
        np.clip(0.5 * (before - after) / max(before - 2 * here + after, 1e-300), -0.5, 0.5)
    )
    return float(shifts[best] + between * (shifts[1] - shifts[0]))


def _left(channels: Sequence[_Channel], shifts: Indices) -> Array:
    """The logarithm of the share of the square of the channels that the motion leaves, if they come
    `shifts` rows later, as a mean over them: of all rows, and of those without each of the blocks,
    (blocks + 1, shifts)."""
    found = [np.zeros((_BLOCKS + 1, len(shifts)))]
    for channel in channels:
        shifted = channel.values[channel.rows[:, None] + shifts].astype(float)
        basis = np.linalg.svd(channel.columns, full_matrices=False)[0]
        centred = shifted - shifted.mean(axis=0)
        error = centred - basis @ (basis.T @ centred)
        squares, errors = (_without_blocks(each**2, channel.blocks) for each in (centred, error))
        found.append(np.log(np.maximum(errors / np.maximum(squares, 1e-300), _LEAST_SHARE)))
    return np.asarray(np.mean(found[1:] or found, axis=0))


def _without_blocks(squares: Array, blocks: Indices) -> Array:
    """Sums of squares (n, k) of all rows, and without each block, (blocks + 1, k)."""
    parts = np.zeros((_BLOCKS, squares.shape[1]))
    np.add.at(parts, blocks, squares)
    total = parts.sum(axis=0)
    return np.vstack([total, total - parts])


def without_spikes(channel: Array) -> Array:
    """The channel (n,) with the median of the neighbours in the place of what is far off it."""
    # every process that serves requests would hold it, and only logs are filtered
    from scipy.ndimage import median_filter

    middle = median_filter(channel, _NEIGHBOURS)
    low, high = np.percentile(middle, [2, 98])
    return np.asarray(np.where(np.abs(channel - middle) > _FAR * (high - low), middle, channel))


def smooth(channel: Array, rate: float) -> Array:
    """The channel (n,) as means over 0.01 s before and behind."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(channel, 2 * round(_AVERAGE * rate) + 1))
