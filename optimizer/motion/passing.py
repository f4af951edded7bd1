"""Passing of given configurations by a motion, in order: times and deviations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array


@dataclass(frozen=True)
class PassSettings:
    """Settings of the search for the times of passing."""

    least_instants: int = 401
    """Smallest number of evenly spaced instants of the first search."""
    instants_per_pass: int = 200
    """Evenly spaced instants of the first search per configuration."""
    refinements: int = 8
    """Number of Newton steps on each time."""


PASSING = PassSettings()


def pass_times(curve: BSpline, passes: Array) -> Array:
    """Find the ascending times of least distance between a curve and given configurations.

    Args:
        curve: motion of r joints over [0, T].
        passes: configurations in the order of passing, shape (k, r) [rad].

    Returns:
        Ascending times, shape (k,) [s].
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
    """Refine times of passing by Newton's method.

    Args:
        curve: motion of r joints over [0, T].
        passes: configurations, shape (k, r) [rad].
        times: times to begin with, shape (k,) [s].
        step: greatest change of a time [s].

    Returns:
        Times of least distance to the configurations, shape (k,) [s].
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
    """Deviation of a curve from every configuration in `passes` (k, r) at its time of passing.

    Returns:
        Largest absolute deviation over the joints, shape (k,) [rad].
    """
    return np.asarray(np.abs(curve(pass_times(curve, passes)) - passes).max(axis=1, initial=0.0))


def _nearest_in_order(samples: Array, passes: Array) -> list[int]:
    """Ascending samples, one per pass, with the least sum of squared distances from the passes."""
    best, chosen = np.zeros(len(samples)), list[Array]()
    for q in passes:
        total = best + ((samples - q) ** 2).sum(axis=1)
        best = np.minimum.accumulate(total)
        # index of the sample with the minimum so far
        chosen.append(np.maximum.accumulate(np.where(total == best, np.arange(len(total)), 0)))
    indices, last = list[int](), len(samples) - 1
    for index_of in reversed(chosen):
        last = int(index_of[last])
        indices.append(last)
    return indices[::-1]
