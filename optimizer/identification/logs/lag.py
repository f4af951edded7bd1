"""By how much the efforts of a log come later than its motion: another clock, or a filter of the driver's.

An effort that comes late falls into wrong accelerations and beside the turns of the friction. The figures would be
wrong, and their standard deviations would not tell.
"""

from __future__ import annotations

import numpy as np

from models.robot import Array, Robot
from optimizer.collision.bodies import Indices
from optimizer.energy.link_regressor import rigid_torques
from optimizer.problem.arm import Payload

LEAST_LAG = 0.02
"""Shorter lags [s] are left as they are: controllers' own filters have some milliseconds."""
_MOST_LAG = 0.2  # s that is sought
_MOST_ROWS, _STEPS = 2000, 20
_LEAST_SPEED = 0.05  # rad/s of the rows that are compared
_LEAST_ROWS = 50  # of a joint
_INLIERS = (2, 98)  # per cent of its efforts between which they count
_LEAST_SHARE = 1e-6  # below it, all is explained
_MOST_LEFT = 0.7  # share of the square of the misfit that the lag leaves of it: what leaves more is no lag


def lag_of(
    robot: Robot, payload: Payload, gravity: Array, q: Array, v: Array, a: Array, effort: Array, rate: float
) -> float:
    """The time [s] by which efforts (n, joints) come after the motion q, v, a (n, joints), negative if before.

    0 where it is short, or does not explain much of what the rigid model and friction leave."""
    edge = max(2, round(_MOST_LAG * rate))
    rows = np.arange(edge, len(q) - edge, max(1, -(-len(q) // _MOST_ROWS)))
    if len(rows) < _LEAST_ROWS:
        return 0.0
    at = [each[rows].astype(float) for each in (q, v, a)]
    rigid = rigid_torques(robot.loaded_model(payload.mass, payload.com, payload.inertia, gravity), *at)
    step = max(1, edge // _STEPS)
    coarse = np.arange(-(edge // step), edge // step + 1) * step
    left = _left(rigid, at[1], at[2], effort, rows, coarse)
    best, none = int(np.argmin(left)), len(coarse) // 2
    if best in (0, len(left) - 1) or left[best] - left[none] > np.log(_MOST_LEFT):
        return 0.0
    fine = int(coarse[best]) + np.arange(-_STEPS, _STEPS + 1) * max(1, step // _STEPS)
    fine = fine[np.abs(fine) <= edge]
    left = _left(rigid, at[1], at[2], effort, rows, fine)
    best = int(np.clip(np.argmin(left), 1, len(left) - 2))
    before, here, after = left[best - 1 : best + 2]
    # the least of the parabola through three of them
    between = float(np.clip(0.5 * (before - after) / max(before - 2 * here + after, 1e-300), -0.5, 0.5))
    lag = float(fine[best] + between * (fine[1] - fine[0])) / rate
    return lag if abs(lag) >= LEAST_LAG else 0.0


def _left(rigid: Array, v: Array, a: Array, effort: Array, rows: Indices, shifts: Indices) -> Array:
    """The logarithm of the share of the square of the efforts that the motion of `rows` leaves, if they come `shifts`
    rows later: its mean over the joints."""
    found = [np.zeros(len(shifts))]
    for joint in range(v.shape[1]):
        # slower ones say more of how friction begins than of when
        use = np.abs(v[:, joint]) > _LEAST_SPEED
        shifted = effort[rows[use, None] + shifts, joint].astype(float)
        if len(shifted) < _LEAST_ROWS or np.ptp(shifted) == 0:
            continue
        # spikes would outweigh all else
        shifted = np.clip(shifted, *np.percentile(shifted, _INLIERS))
        load, speed = rigid[use, joint], v[use, joint]
        sign = np.sign(speed)
        columns = np.stack([load, a[use, joint], sign, np.abs(load) * sign, speed, np.ones_like(speed)], axis=1)
        basis = np.linalg.svd(columns, full_matrices=False)[0]
        centred = shifted - shifted.mean(axis=0)
        square = np.maximum((centred**2).sum(axis=0), 1e-300)
        share = 1 - ((basis.T @ centred) ** 2).sum(axis=0) / square
        found.append(np.log(np.maximum(share, _LEAST_SHARE)))
    return np.asarray(np.mean(found[1:] or found, axis=0))
