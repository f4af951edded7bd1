"""The rows of a QP, and its solution by DAQP (dual active set; Arnström, Bemporad, Axehill 2022).

DAQP gets the QP in variables y with x = W y that make the Hessian the identity. It would factorise
the Hessian for each QP again, and transform all rows with it, at a tenth of the speed of BLAS.
"""

from __future__ import annotations

from typing import Any

import daqp
import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.deadline import watched_time_left
from joulepath.optimizer.solve.nlp.active_path_constraints import Index

# least time [s] that a QP gets: most take a millisecond
LEAST_TIME = 0.05
# iterations of DAQP after which a QP counts as infeasible. Most take some tens; a relaxed one that
# collides everywhere has thousands of active rows, and each of its last iterations takes
# milliseconds
MOST_QP_ITERATIONS = 1200
# rows that there is room for at first: more than most QPs have
ROOM = 320

Places = tuple[Index, Index, Index]  # derivative, coordinate, grid point

_DAQP_OPTIMAL = 1
_ACTIVE, _EQUAL, _SOFT = 1, 5, 8
_INFINITE = 1e30


class Listed:
    """Rows of one kind, and the place of each, which is so many indices: of a bound, its side and
    its variable.
    """

    def __init__(self, indices: int) -> None:
        none = np.zeros(0, dtype=int)
        self._parts = [(none,) * (1 + indices)]

    def add(self, rows: Index, places: tuple[Index, ...]) -> None:
        """Add rows at places."""
        self._parts.append((rows, *places))

    def joined(self) -> tuple[Index, Any]:
        """All rows (k,), and their places: an array (k,) for each index."""
        rows, *places = (np.concatenate(each) for each in zip(*self._parts, strict=True))
        return rows, tuple(places)


class QPRows:
    """Constraints least ≤ A y ≤ most in whitened variables; rows are added at the end.

    `hard` rows are never relaxed. `rates` are the rows of limits on rates, by derivative,
    coordinate and grid point; `bounds` those of bounds, by side and variable; `path` those of path
    constraints, by point and column. `chosen` (2, 3, r, M) marks the lower and upper limits on
    rates with a row, `bounded` (2, n) the lower and upper bounds.
    """

    def __init__(self, whitening: Array, grid: tuple[int, ...]) -> None:
        self.whitening, (n, size) = whitening, whitening.shape
        self.count = self._transformed = 0
        self.gradients, self._fresh = list[Array](), list[Array]()
        # of these, the first `count` rows are in use
        self._A = np.empty((ROOM, size))
        self._least, self._most = np.empty(ROOM), np.empty(ROOM)
        self._hard, self._active = np.empty(ROOM, dtype=bool), np.empty(ROOM, dtype=bool)
        self.chosen, self.bounded = np.zeros((2, *grid), dtype=bool), np.zeros((2, n), dtype=bool)
        self.rates, self.bounds, self.path = Listed(3), Listed(2), Listed(2)
        self._identity = np.eye(size)

    def add(
        self,
        gradients: Array,
        most: Array,
        least: Array | float = -_INFINITE,
        hard: bool = False,
        active: Mask | bool = False,
    ) -> Index:
        """Add rows with gradients (rows, n) by the scaled variables, and return their numbers.

        `active` (rows,) is a guess of those that hold with equality.
        """
        self.gradients.append(gradients)
        self._fresh.append(gradients)
        first, self.count = self.count, self.count + len(most)
        while self.count > len(self._A):
            self._make_room()
        rows = slice(first, self.count)
        self._least[rows], self._most[rows] = least, most
        self._hard[rows], self._active[rows] = hard, active
        return np.arange(first, self.count)

    def _make_room(self) -> None:
        """Room for twice as many rows."""
        for name in ("_A", "_least", "_most", "_hard", "_active"):
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old, np.empty_like(old)]))

    def _transform(self) -> None:
        """Transform the rows added since the last solve: one product for all of them."""
        if self.count > self._transformed:
            rows = slice(self._transformed, self.count)
            np.matmul(np.concatenate(self._fresh), self.whitening, out=self._A[rows])
        self._fresh, self._transformed = [], self.count

    def add_kinematic(
        self,
        gradients: Array,
        most: Array,
        places: Places,
        upper: Mask,
        active: Mask | bool = False,
    ) -> None:
        """Add the rows of places that have none yet for their `upper` or lower limit; see `add`."""
        self.rates.add(self.add(gradients, most, active=active), places)
        self.chosen[upper.astype(int), *places] = True

    def add_path(
        self, gradients: Array, slack: Array, passed: tuple[Index, Index], active: Mask
    ) -> None:
        """Add the rows of path constraints that have none yet; see `add`."""
        self.path.add(self.add(gradients, slack, active=active), passed)

    def add_bounds(self, bounds: Array, wanted: Mask) -> None:
        """Add the `wanted` (2, n) lower and upper bounds of variables, if they have no row yet."""
        sides = np.nonzero(wanted & ~self.bounded)
        side, variable = sides
        gradients = np.zeros((len(side), len(self.whitening)))
        sign = np.where(side, 1.0, -1.0)
        gradients[np.arange(len(side)), variable] = sign
        self.bounds.add(self.add(gradients, sign * bounds[sides], hard=True), sides)
        self.bounded[sides] = True

    def solve(self, gradient: Array, relax: bool) -> tuple[Array, Array, bool]:
        """DAQP's y, the multipliers of the rows, and whether it found them."""
        self._transform()
        used = slice(self.count)
        least, most, active = self._least[used], self._most[used], self._active[used]
        sense = np.zeros(self.count, dtype=np.int32)
        if relax:
            sense[~self._hard[used]] = _SOFT
        else:
            sense[active] = _ACTIVE
        sense[least == most] = _EQUAL
        left = watched_time_left()
        y, _, flag, info = daqp.solve(
            self._identity,
            gradient,
            self._A[used],
            most,
            least,
            sense,
            primal_tol=1e-9,
            eps_prox=0.0,
            rho_soft=1e-6,
            iter_limit=MOST_QP_ITERATIONS,
            time_limit=max(left, LEAST_TIME) if np.isfinite(left) else 0.0,  # 0: no limit
        )
        found = bool(flag >= _DAQP_OPTIMAL)
        if found:
            # what the next solve starts from
            active[:] = info["lam"] > 0
        return y, info["lam"], found
