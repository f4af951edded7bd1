"""The seven-segment profile: the fastest rest-to-rest motion of a joint under speed, acceleration and jerk limits.

Jerk up, hold, jerk down, cruise, and the same in reverse (Biagiotti, Melchiorri 2008, sec. 3.4).
"""

from __future__ import annotations

import numpy as np

from models.robot import Array, Limits


def shortest_duration(travel: Array, limits: Limits) -> Array:
    """Least time [s] of a rest-to-rest motion under speed, acceleration and jerk limits; travel (..., nq) → (...).

    Every joint needs at least its own profile, and the arm at least what its slowest joint needs.
    """
    return np.asarray(_durations(np.abs(travel), limits).max(axis=-1))


def _durations(distance: Array, limits: Limits) -> Array:
    """Length [s] of every joint's profile, distance (..., nq) ≥ 0."""
    v, a, j = limits.v_max, limits.a_max, limits.j_max
    reaches_a = v * j >= a * a
    ramp = np.where(reaches_a, v / a + a / j, 2 * np.sqrt(v / j))
    with_a = a / j + np.sqrt((a / j) ** 2 + 4 * distance / a)
    jerk_only = 4 * np.cbrt(distance / (2 * j))
    short = np.where(reaches_a & (distance >= 2 * a**3 / j**2), with_a, jerk_only)
    return np.asarray(np.where(distance >= v * ramp, distance / v + ramp, short))


def switches(travel: Array, duration: float, limits: Limits) -> Array:
    """Where in [0, 1] the jerk of the leading joint switches when it takes `duration` [s] for travel (nq,), ascending.

    The leading joint is the one whose own profile is longest; slowed to `duration`, it cruises at a lower speed. Empty
    where it would not reach its greatest acceleration.
    """
    distance = np.abs(travel)
    lead = int(_durations(distance, limits).argmax())
    d, a, j = distance[lead], limits.a_max[lead], limits.j_max[lead]
    # duration = d / v + v / a + a / j, solved for the speed v of the cruise
    moving = duration - a / j
    root = moving * moving - 4 * d / a
    speed = a / 2 * (moving - np.sqrt(max(root, 0.0)))
    ramp = speed / a + a / j
    if root < -1e-9 * moving * moving or speed < a * a / j or 2 * ramp > duration * (1 + 1e-9):
        return np.zeros(0)
    early = np.array([a / j, speed / a, ramp]) / duration
    return np.unique(np.round(np.concatenate([early, 1 - early]), 9))
