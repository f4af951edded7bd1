"""The rows of a QP, and its solution by DAQP (dual active set; Arnström, Bemporad, Axehill 2022).

DAQP gets the QP in variables y with x = W y that make the Hessian the identity. It would factorise the Hessian for each
QP again, and transform all rows with it, at a tenth of the speed of BLAS.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import daqp
import numpy as np

from models.robot import Array, Mask
from optimizer.deadline import watched_time_left
from optimizer.nlp.active_path_constraints import Index

# least time [s] that a QP gets: most take a millisecond
LEAST_TIME = 0.05
# iterations of DAQP after which a QP counts as infeasible. Most take some tens; a relaxed one that collides everywhere
# has thousands of active rows, and each of its last iterations takes milliseconds
MOST_QP_ITERATIONS = 1200

Places = tuple[Index, Index, Index]  # derivative, coordinate, grid point

_DAQP_OPTIMAL = 1
_ACTIVE, _EQUAL, _SOFT = 1, 5, 8
_INFINITE = 1e30


@dataclass(frozen=True)
class _Fresh:
    """Rows added since the last solve, as in `QPRows`, but with gradients (rows, n) by the scaled variables."""

    gradients: Array
    least: Array
    most: Array
    hard: Mask
    active: Mask


class QPRows:
    """Constraints least ≤ A y ≤ most in whitened variables; rows are added at the end.

    `hard` rows are never relaxed. `chosen` (2, 3, r, M) marks the lower and upper limits on rates with a row, by grid
    point, `places` lists the points, and `kinematic` is the row of each. In the same way `bounded` (2, n) marks the
    lower and upper bounds with a row. `passed` (point, column) lists the path constraints with a row,
    and `path` is the row of each.
    """

    def __init__(self, whitening: Array, grid: tuple[int, ...]) -> None:
        self.whitening, n = whitening, len(whitening)
        self.count = 0
        self.gradients, self._fresh = list[Array](), list[_Fresh]()
        self.A = np.zeros((0, whitening.shape[1]))
        self.least, self.most = np.zeros(0), np.zeros(0)
        self.hard, self.active = np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
        self.chosen, self.bounded = np.zeros((2, *grid), dtype=bool), np.zeros((2, n), dtype=bool)
        none = np.zeros(0, dtype=int)
        self.places: Places = (none, none, none)
        self.sides: tuple[Index, Index] = (none, none)
        self.passed: tuple[Index, Index] = (none, none)
        self.kinematic, self.bounds, self.path = none, none, none
        self._identity = np.eye(whitening.shape[1])

    def add(
        self,
        gradients: Array,
        most: Array,
        least: Array | None = None,
        hard: bool = False,
        active: Mask | None = None,
    ) -> Index:
        """Add rows with gradients (rows, n) by the scaled variables, and return their numbers.

        `active` (rows,) is a guess of those that hold with equality.
        """
        count = len(most)
        self.gradients.append(gradients)
        if not count:
            return np.zeros(0, dtype=int)
        self._fresh.append(
            _Fresh(
                gradients,
                np.full(count, -_INFINITE) if least is None else least,
                most,
                np.full(count, hard),
                np.zeros(count, dtype=bool) if active is None else active,
            )
        )
        self.count += count
        return self.count - count + np.arange(count)

    def _join(self) -> None:
        """Join the rows added since the last solve: one product for all of them."""
        fresh, self._fresh = self._fresh, []
        if not fresh:
            return
        self.A = np.concatenate([self.A, np.concatenate([each.gradients for each in fresh]) @ self.whitening])
        for name in ("least", "most", "hard", "active"):
            setattr(self, name, np.concatenate([getattr(self, name), *(getattr(each, name) for each in fresh)]))

    def add_kinematic(
        self, gradients: Array, most: Array, places: Places, upper: Mask, active: Mask | None = None
    ) -> None:
        """Add the rows of places that have none yet for their `upper` or lower limit; see `add`."""
        self.kinematic = np.concatenate([self.kinematic, self.add(gradients, most, active=active)])
        self.places = _joined(self.places, places)
        self.chosen[upper.astype(int), *places] = True

    def add_path(self, gradients: Array, slack: Array, passed: tuple[Index, Index], active: Mask) -> None:
        """Add the rows of path constraints that have none yet; see `add`."""
        self.path = np.concatenate([self.path, self.add(gradients, slack, active=active)])
        self.passed = _joined(self.passed, passed)

    def add_bounds(self, bounds: Array, wanted: Mask) -> None:
        """Add the `wanted` (2, n) lower and upper bounds of variables, if they have no row yet."""
        sides = np.nonzero(wanted & ~self.bounded)
        side, variable = sides
        gradients = np.zeros((len(side), len(self.whitening)))
        sign = np.where(side, 1.0, -1.0)
        gradients[np.arange(len(side)), variable] = sign
        self.bounds = np.concatenate([self.bounds, self.add(gradients, sign * bounds[sides], hard=True)])
        self.sides = _joined(self.sides, sides)
        self.bounded[sides] = True

    def solve(self, gradient: Array, relax: bool) -> tuple[Array, Array, bool]:
        """DAQP's y, the multipliers of the rows, and whether it found them. `active` is its guess, then its result."""
        self._join()
        sense = np.zeros(len(self.most), dtype=np.int32)
        if relax:
            sense[~self.hard] = _SOFT
        else:
            sense[self.active] = _ACTIVE
        sense[self.least == self.most] = _EQUAL
        left = watched_time_left()
        y, _, flag, info = daqp.solve(
            self._identity, gradient, self.A, self.most, self.least, sense,
            primal_tol=1e-9, eps_prox=0.0, rho_soft=1e-6, iter_limit=MOST_QP_ITERATIONS,
            time_limit=max(left, LEAST_TIME) if np.isfinite(left) else 0.0,  # 0: no limit
        )  # fmt: skip
        found = bool(flag >= _DAQP_OPTIMAL)
        if found:
            self.active = info["lam"] > 0
        return y, info["lam"], found


def _joined(first: tuple[Index, ...], second: tuple[Index, ...]) -> Any:
    """Indices of the first places, then of the second."""
    return tuple(np.concatenate(both) for both in zip(first, second, strict=True))
