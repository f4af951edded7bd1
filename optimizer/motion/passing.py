"""When a motion passes through given configurations, one after the other, and how near it comes to
them.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array

# instants among which the nearest ones are looked for first, at least and per pass; steps that
# refine them
LEAST_INSTANTS, INSTANTS_PER_PASS, REFINEMENTS = 401, 200, 8


def pass_times(curve: BSpline, passes: Array) -> Array:
    """Ascending times (k,) at which a curve over [0, T] is nearest to the configurations `passes`
    (k, r), in order.
    """
    if not len(passes):
        return np.zeros(0)
    t = np.linspace(
        0.0, float(curve.t[-1]), max(LEAST_INSTANTS, INSTANTS_PER_PASS * (len(passes) + 1))
    )
    at = np.array(_nearest_in_order(np.asarray(curve(t)), passes))
    return nearby(curve, passes, t[at], float(t[1]))


def nearby(curve: BSpline, passes: Array, times: Array, step: float) -> Array:
    """The times (k,) next to `times`, by no more than `step` each, at which a curve is nearest to
    `passes` (k, r).
    """
    found = times
    for _ in range(REFINEMENTS):
        position, speed = curve(found), curve(found, 1)
        size = (speed**2).sum(axis=1)
        ahead = ((passes - position) * speed).sum(axis=1) / np.where(size > 0, size, 1.0)
        found = np.clip(
            found + ahead, np.maximum(times - step, 0.0), np.minimum(times + step, curve.t[-1])
        )
    return np.asarray(found)


def deviations(curve: BSpline, passes: Array) -> Array:
    """Largest deviations (k,) of a coordinate from the configurations `passes` (k, r), where the
    curve passes them.
    """
    return np.asarray(np.abs(curve(pass_times(curve, passes)) - passes).max(axis=1, initial=0.0))


def _nearest_in_order(samples: Array, passes: Array) -> list[int]:
    """Ascending samples, one for each pass, whose squared distances from the passes have the least
    sum.
    """
    best, chosen = np.zeros(len(samples)), list[Array]()
    for q in passes:
        total = best + ((samples - q) ** 2).sum(axis=1)
        best = np.minimum.accumulate(total)
        # the sample that each minimum so far is from
        chosen.append(np.maximum.accumulate(np.where(total == best, np.arange(len(total)), 0)))
    found, last = list[int](), len(samples) - 1
    for each in reversed(chosen):
        last = int(each[last])
        found.append(last)
    return found[::-1]
