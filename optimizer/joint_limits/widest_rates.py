"""The widest limits on speeds and accelerations under a condition.

At first, one factor c is common to all limits: c times the largest speeds and c² times the largest
accelerations, like motions slowed down to 1 / c times their duration. Limits without effect on the
condition are then raised further, again by a common factor, until none is left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.joint_limits.torque_load import Rates


@dataclass(frozen=True)
class WideningSettings:
    """Settings of the widening."""

    bisections: int = 12
    """Bisections of a factor; 1 / 4096 of its range is left."""
    step: float = 1.02
    """Factor on a single limit, to see whether the condition stops it."""


WIDENING = WideningSettings()


def widest_rates(most: Limits, holds: Callable[[Rates], bool]) -> Rates:
    """Limits with the greatest possible least factor, then the greatest second least, and so on.

    Args:
        most: the largest limits.
        holds: the condition; if it holds for some limits, it holds for all lower limits.
    """

    def rates(factors: Array) -> Rates:
        return Rates(most.v_max * factors[0], most.a_max * factors[1] ** 2)

    factors = np.zeros((2, len(most.v_max)))
    free, level = np.ones_like(factors, dtype=bool), 0.0
    while free.any():
        if holds(rates(np.where(free, 1.0, factors))):
            return rates(np.where(free, 1.0, factors))
        high = 1.0
        for _ in range(WIDENING.bisections):
            middle = (level + high) / 2
            if holds(rates(np.where(free, middle, factors))):
                level = middle
            else:
                high = middle
        factors[free] = level
        stopped = free.copy()
        for at in np.argwhere(free):
            alone = factors.copy()
            alone[*at] = min(1.0, WIDENING.step * level)
            stopped[*at] = not holds(rates(alone))
        # within the precision of the factor, none may be stopped alone
        free = free & ~stopped if stopped.any() else np.zeros_like(free)
    return rates(factors)
