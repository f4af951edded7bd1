"""How far the coordinates of a place may be off until the cycles need too much more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.placement.refinement import Box, Energy


@dataclass(frozen=True)
class ToleranceSettings:
    """Settings of tolerances."""

    excess: float = 0.02
    """Share of the energy that counts as little."""
    tries: int = 4
    """Places tried on either side of a coordinate."""
    cautious: float = 0.95
    """Share of the offset tried that a curve through the last place gives."""
    enough: float = 0.1
    """Relative distance of an offset that works from one that does not at which the tries end."""


TOLERANCE = ToleranceSettings()


def tolerances(energy: Energy, x: Array, value: float, box: Box, step: Array) -> Array | None:
    """Changes of single coordinates up to which the energy was found to rise by little.

    Args:
        energy: energy at coordinates.
        x: coordinates of the place, shape (n,) [m, rad].
        value: energy there [J].
        box: ranges of the coordinates.
        step: first changes tried, shape (n,) [m, rad].

    Returns:
        Changes to the lower and the upper side, shape (n, 2); None if the time was up.
    """
    found = np.zeros((len(x), 2))
    for k in range(len(x)):
        for side, end in enumerate((box.low[k], box.high[k])):
            offset = _offset(energy, x, value, k, float(end - x[k]), float(step[k]))
            if offset is None:
                return None
            found[k, side] = offset
    return found


def _offset(
    energy: Energy, x: Array, value: float, k: int, most: float, step: float
) -> float | None:
    """Change of coordinate `k` towards `most` [m, rad]; None if the time was up."""
    allowed, side = TOLERANCE.excess * abs(value), np.sign(most)
    works, fails, offset = 0.0, np.inf, min(step, abs(most))
    for _ in range(TOLERANCE.tries):
        near = np.isfinite(fails) and fails - works <= TOLERANCE.enough * fails
        if offset <= works or near:
            break
        at = x.copy()
        at[k] += side * offset
        found = energy(at)
        if found is None:
            return None
        # the energy rises like a parabola from a minimum, and evenly from the end of a range
        rise, power = found - value, 0.5 if np.isinf(fails) else 1.0
        if rise <= allowed:
            works = offset
        else:
            fails = offset
        if 0 < rise < np.inf:
            ahead = offset * TOLERANCE.cautious * (allowed / rise) ** power
        else:
            ahead = offset * (0.5 if rise > 0 else 3.0)
        ahead = min(ahead, 3 * offset, abs(most))
        offset = float(ahead if works < ahead < fails else (works + min(fails, abs(most))) / 2)
    return float(side * works) if works else 0.0
