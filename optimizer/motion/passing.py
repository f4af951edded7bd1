"""Times at which a motion passes given configurations in order, and its deviations from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array


@dataclass(frozen=True)
class PassSettings:
    """Search for the times at which a motion passes configurations."""

    least_instants: int = 401
    """Smallest number of evenly spaced instants of the first search."""
    instants_per_pass: int = 200
    """Evenly spaced instants of the first search per configuration."""
    refinements: int = 8
    """Newton steps that refine the instants."""


PASSING = PassSettings()


def pass_times(curve: BSpline, passes: Array) -> Array:
    """Ascending times (k,) at which a curve over [0, T] is nearest to the configurations `passes`
    (k, r), in order.
    """
    if not len(passes):
        return np.zeros(0)
    t = np.linspace(
        0.0,
        float(curve.t[-1]),
        max(PASSING.least_instants, PASSING.instants_per_pass * (len(passes) + 1)),
    )
    nearest = np.array(_nearest_in_order(np.asarray(curve(t)), passes))
    return refined_pass_times(curve, passes, t[nearest], float(t[1]))


def refined_pass_times(curve: BSpline, passes: Array, times: Array, step: float) -> Array:
    """Times (k,) at which a curve is nearest to `passes` (k, r), within `step` of the given
    times.
    """
    refined = times
    for _ in range(PASSING.refinements):
        position, speed = curve(refined), curve(refined, 1)
        size = (speed**2).sum(axis=1)
        ahead = ((passes - position) * speed).sum(axis=1) / np.where(size > 0, size, 1.0)
        refined = np.clip(
            refined + ahead, np.maximum(times - step, 0.0), np.minimum(times + step, curve.t[-1])
        )
    return np.asarray(refined)


def deviations(curve: BSpline, passes: Array) -> Array:
    """Largest deviation (k,) of a coordinate of a curve from every configuration in `passes` (k,
    r), at the times of passing.
    """
    return np.asarray(np.abs(curve(pass_times(curve, passes)) - passes).max(axis=1, initial=0.0))


def _nearest_in_order(samples: Array, passes: Array) -> list[int]:
    """Ascending samples, one per pass, with the least sum of squared distances from the passes."""
    best, chosen = np.zeros(len(samples)), list[Array]()
    for q in passes:
        total = best + ((samples - q) ** 2).sum(axis=1)
        best = np.minimum.accumulate(total)
        # Sample at which every running minimum was reached.
        chosen.append(np.maximum.accumulate(np.where(total == best, np.arange(len(total)), 0)))
    indices, last = list[int](), len(samples) - 1
    for index_of in reversed(chosen):
        last = int(index_of[last])
        indices.append(last)
    return indices[::-1]
