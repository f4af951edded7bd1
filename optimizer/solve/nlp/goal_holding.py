"""Energy of holding the arm at the goal, with the goal as a decision variable of an NLP.

The arm waits at the goal until the end of its dwell. The holding time of the motors is linear in
the duration of the motion. The constant and the time weight of the NLP contain the energy at the
given goal; this module adds the difference at another goal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array


@dataclass(frozen=True)
class GoalHolding:
    """Energy of holding, relative to the energy at the given goal."""

    power: Callable[[Array], Array]
    """Holding powers (n,) [W] of configurations (n, nq) [rad]."""

    given: float
    """Holding power at the given goal [W]."""

    longest: float
    """Time on the motors after a motion of zero duration [s]."""

    rate: float
    """Decrease of the time on the motors per second of the motion [1]."""

    step: float = 1e-2
    """Step of the differences, wide enough to smooth the corner of power of an unloaded joint
    [rad]."""

    def value(self, q: Array, T: float) -> float:
        """Energy of holding at a goal, relative to the given goal.

        Args:
            q: goal, shape (nq,) [rad].
            T: duration of the motion [s].

        Returns:
            The difference [J].
        """
        return self._wait(T) * (float(self.power(q[None])[0]) - self.given)

    def derivatives(self, q: Array, T: float) -> tuple[float, Array, Array]:
        """The energy [J], its gradient (nq + 1,) and Hessian (nq + 1, nq + 1) by q and T."""
        nq, step = len(q), self.step
        i, j = np.triu_indices(nq, 1)
        unit = step * np.eye(nq)
        beside = np.concatenate(
            [np.zeros((1, nq)), unit, -unit, unit[i] + unit[j], -unit[i] - unit[j]]
        )
        at = self.power(q + beside)
        middle, up, down = at[0], at[1 : nq + 1], at[nq + 1 : 2 * nq + 1]
        both = at[2 * nq + 1 :].reshape(2, -1).sum(axis=0)
        slope, second = (up - down) / (2 * step), np.diag(up - 2 * middle + down)
        second[i, j] = second[j, i] = (both - (up + down)[i] - (up + down)[j] + 2 * middle) / 2
        wait, hessian = self._wait(T), np.zeros((nq + 1, nq + 1))
        hessian[:nq, :nq] = wait * second / step**2
        hessian[:nq, nq] = hessian[nq, :nq] = -self.rate * slope
        more = float(middle) - self.given
        return wait * more, np.append(wait * slope, -self.rate * more), hessian

    def _wait(self, T: float) -> float:
        return self.longest - self.rate * T
