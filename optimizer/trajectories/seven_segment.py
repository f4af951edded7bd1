"""The seven-segment profile: the fastest rest-to-rest motion of a joint under speed, acceleration and jerk limits.

Jerk up, hold, jerk down, cruise, and the same in reverse (Biagiotti, Melchiorri 2008, sec. 3.4).
"""

from __future__ import annotations

import functools

import numpy as np
from scipy.optimize import brentq

from models.robot import Array, Limits

# switches closer than this share of the motion count as one
CLOSEST = 1e-3


def shortest_duration(displacement: Array, limits: Limits) -> Array:
    """Least time [s] of a rest-to-rest motion under speed, acceleration and jerk limits; displacement (..., nq) →
    (...).

    Every joint needs at least its own profile, and the arm at least what its slowest joint needs.
    """
    return np.asarray(_durations(np.abs(displacement), limits).max(axis=-1))


def _durations(distance: Array, limits: Limits) -> Array:
    """Length [s] of every joint's profile, distance (..., nq) ≥ 0."""
    v, a, j = limits.v_max, limits.a_max, limits.j_max
    reaches_a = v * j >= a * a
    ramp = np.where(reaches_a, v / a + a / j, 2 * np.sqrt(v / j))
    with_a = a / j + np.sqrt((a / j) ** 2 + 4 * distance / a)
    jerk_only = 4 * np.cbrt(distance / (2 * j))
    short = np.where(reaches_a & (distance >= 2 * a**3 / j**2), with_a, jerk_only)
    return np.asarray(np.where(distance >= v * ramp, distance / v + ramp, short))


def _jerk_limited(speed: float, distance: float, jerk: float) -> float:
    """Time [s] to displacement a distance > 0 at a cruising speed that jerk alone limits the way to."""
    return float(distance / speed + 2 * np.sqrt(speed / jerk))


def switches(displacement: Array, duration: float, limits: Limits) -> Array:
    """Where in [0, 1] the jerk of the leading joint switches when it takes `duration` [s] for displacement (nq,),
    ascending.

    The leading joint is the one whose own profile is longest; retimed to `duration`, it cruises at a lower speed. A
    duration shorter than its own counts as its own.
    """
    distance = np.abs(displacement)
    own = _durations(distance, limits)
    lead = int(own.argmax())
    duration = max(duration, float(own[lead]))
    d, a, j = distance[lead], limits.a_max[lead], limits.j_max[lead]
    if d == 0:
        return np.zeros(0)
    # duration = d / v + v / a + a / j, solved for the speed v of the cruise
    moving = duration - a / j
    speed = a / 2 * (moving - np.sqrt(max(moving * moving - 4 * d / a, 0.0)))
    if speed < a * a / j:
        # it never holds its greatest acceleration: duration = d / v + 2 sqrt(v / j), which falls with v up to no cruise
        top = min(a * a / j, float(np.cbrt(d * d * j / 4)))
        needed = functools.partial(_jerk_limited, distance=d, jerk=j)
        speed = top if needed(top) >= duration else brentq(lambda v: needed(v) - duration, d / duration, top)
        ramp = np.sqrt(speed / j)
        early = np.array([ramp, 2 * ramp]) / duration
    else:
        early = np.array([a / j, speed / a, speed / a + a / j]) / duration
    both = np.unique(np.concatenate([early, 1 - early]))
    return np.asarray(both[np.append(True, np.diff(both) > CLOSEST)])
