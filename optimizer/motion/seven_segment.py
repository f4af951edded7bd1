"""Seven-segment profile: time-optimal rest-to-rest motion of a joint under speed, acceleration and
jerk limits.

Segments of constant jerk: acceleration rises, is constant, falls; cruise; the same in reverse
(Biagiotti, Melchiorri 2008, sec. 3.4).
"""

from __future__ import annotations

import functools

import numpy as np
from scipy.optimize import brentq

from joulepath.models.robot import Array, Limits


def shortest_duration(displacement: Array, limits: Limits) -> Array:
    """Least duration (...) [s] of a rest-to-rest motion over a displacement (..., nq) [rad],
    without torque limits.

    It is the longest of the profiles of all joints.
    """
    return np.asarray(_durations(np.abs(displacement), limits).max(axis=-1))


def _durations(distance: Array, limits: Limits) -> Array:
    """Duration (..., nq) [s] of every joint's profile over a distance (..., nq) ≥ 0 [rad]."""
    v, a, j = limits.v_max, limits.a_max, limits.j_max
    reaches_a = v * j >= a * a
    ramp = np.where(reaches_a, v / a + a / j, 2 * np.sqrt(v / j))
    with_a = a / j + np.sqrt((a / j) ** 2 + 4 * distance / a)
    jerk_only = 4 * np.cbrt(distance / (2 * j))
    short = np.where(reaches_a & (distance >= 2 * a**3 / j**2), with_a, jerk_only)
    return np.asarray(np.where(distance >= v * ramp, distance / v + ramp, short))


def _jerk_limited(speed: float, distance: float, jerk: float) -> float:
    """Duration [s] over a distance > 0 [rad] with a cruising speed reached without constant
    acceleration.
    """
    return float(distance / speed + 2 * np.sqrt(speed / jerk))


def ramp(displacement: Array, limits: Limits) -> float:
    """Time [s] in which the leading joint reaches its greatest speed in the fastest motion over a
    displacement (nq,) [rad].
    """
    shortest = float(shortest_duration(displacement, limits))
    early = switches(displacement, shortest, limits, closest=0.0)
    return shortest * float(early[early <= 0.5].max(initial=0.0))


def switches(displacement: Array, duration: float, limits: Limits, closest: float = 1e-3) -> Array:
    """Switches of the leading joint's jerk as fractions of `duration` [s], ascending.

    The leading joint is the joint with the longest profile. In a longer duration it cruises at a
    lower speed; a shorter duration is replaced by the duration of its profile.

    Args:
        displacement: displacement (nq,) [rad].
        duration: duration of the motion [s].
        limits: limits of the joints.
        closest: distance of switches, as a fraction of the duration, up to which they count as one.
    """
    distance = np.abs(displacement)
    durations = _durations(distance, limits)
    lead = int(durations.argmax())
    duration = max(duration, float(durations[lead]))
    d, a, j = distance[lead], limits.a_max[lead], limits.j_max[lead]
    if d == 0:
        return np.zeros(0)
    # duration = d / v + v / a + a / j, solved for the cruising speed v.
    moving = duration - a / j
    speed = a / 2 * (moving - np.sqrt(max(moving * moving - 4 * d / a, 0.0)))
    if speed < a * a / j:
        # Without constant acceleration, duration = d / v + 2 sqrt(v / j); it decreases with v as
        # long as there is a cruise.
        top = min(a * a / j, float(np.cbrt(d * d * j / 4)))
        needed = functools.partial(_jerk_limited, distance=d, jerk=j)
        speed = (
            top
            if needed(top) >= duration
            else brentq(lambda v: needed(v) - duration, d / duration, top)
        )
        ramp = np.sqrt(speed / j)
        early = np.array([ramp, 2 * ramp]) / duration
    else:
        early = np.array([a / j, speed / a, speed / a + a / j]) / duration
    both = np.unique(np.concatenate([early, 1 - early]))
    return np.asarray(both[np.append(True, np.diff(both) > closest)])
