"""What holding the arm at the goal draws, where the goal is an unknown of an NLP: more in one
posture than in another.

The arm waits there until its dwell ends. The motors hold it for a time that is linear in the
duration of the motion. The NLP counts what they draw at the goal that was given, by its constant
and its weight of time; this adds what they draw more, or less, at another one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array

# rad: step of the differences, wide enough that a joint's corner of power without load does not
# bend them
STEP = 1e-2


@dataclass(frozen=True)
class GoalHolding:
    """`power` gives the powers (n,) [W] that hold configurations (n, nq) [rad], `given` is that of
    the goal given.

    A motion of duration T is followed by a wait of `longest` - `rate` · T on the motors [s].
    """

    power: Callable[[Array], Array]
    given: float
    longest: float
    rate: float

    def value(self, q: Array, T: float) -> float:
        """Energy [J] at a goal q (nq,) [rad] beside that at the goal given."""
        return self._wait(T) * (float(self.power(q[None])[0]) - self.given)

    def derivatives(self, q: Array, T: float) -> tuple[float, Array, Array]:
        """The energy [J], and its first and second derivatives (nq + 1,) and (nq + 1, nq + 1) by q
        and T.
        """
        nq = len(q)
        i, j = np.triu_indices(nq, 1)
        unit = STEP * np.eye(nq)
        beside = np.concatenate(
            [np.zeros((1, nq)), unit, -unit, unit[i] + unit[j], -unit[i] - unit[j]]
        )
        at = self.power(q + beside)
        middle, up, down = at[0], at[1 : nq + 1], at[nq + 1 : 2 * nq + 1]
        both = at[2 * nq + 1 :].reshape(2, -1).sum(axis=0)
        slope, second = (up - down) / (2 * STEP), np.diag(up - 2 * middle + down)
        second[i, j] = second[j, i] = (both - (up + down)[i] - (up + down)[j] + 2 * middle) / 2
        wait, hessian = self._wait(T), np.zeros((nq + 1, nq + 1))
        hessian[:nq, :nq] = wait * second / STEP**2
        hessian[:nq, nq] = hessian[nq, :nq] = -self.rate * slope
        more = float(middle) - self.given
        return wait * more, np.append(wait * slope, -self.rate * more), hessian

    def _wait(self, T: float) -> float:
        return self.longest - self.rate * T
