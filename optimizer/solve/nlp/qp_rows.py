"""The rows of a QP, and its solution by DAQP (dual active set; Arnström, Bemporad, Axehill 2022).

DAQP gets the QP in variables y with x = W y, in which the Hessian is the identity. Otherwise DAQP
would factorise the Hessian in every QP again, and transform all rows with it, at a tenth of the
speed of BLAS.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import daqp
import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.deadline import watched_time_left
from joulepath.optimizer.solve.nlp.active_path_constraints import Index


@dataclass(frozen=True)
class QPRowsSettings:
    """Settings of the solution of QPs by DAQP."""

    least_time: float = 0.05
    """Time that a QP may always take [s]: most take a millisecond."""

    max_iterations: int = 1200
    """Iterations of DAQP after which a QP counts as infeasible. Most take some tens; a relaxed QP
    that collides everywhere has thousands of active rows, and its last iterations take milliseconds
    each."""

    initial_rows: int = 320
    """Rows for which memory is allocated at first: more than most QPs have."""

    primal_tolerance: float = 1e-9
    """Tolerance of the constraints, which are ratios of limits."""

    softness: float = 1e-6
    """Weight of the violation of a relaxed row, as DAQP's `rho_soft`."""


QP_ROWS = QPRowsSettings()

# derivative, coordinate and grid point of limits on rates
Places = tuple[Index, Index, Index]

# values of DAQP's interface: exit flag, kinds of rows, and no bound
_DAQP_OPTIMAL = 1
_ACTIVE = 1
_EQUAL = 5
_SOFT = 8
_INFINITE = 1e30


class PlacedRows:
    """Numbers of the rows of one kind of constraint, with a tuple of indices per row.

    The indices of a bound, for example, are its side and its variable.
    """

    def __init__(self, indices: int) -> None:
        none = np.zeros(0, dtype=int)
        self._parts = [(none,) * (1 + indices)]

    def add(self, rows: Index, places: tuple[Index, ...]) -> None:
        """Add rows with their indices."""
        self._parts.append((rows, *places))

    def joined(self) -> tuple[Index, Any]:
        """All row numbers (k,), and an array (k,) for every index."""
        rows, *places = (np.concatenate(each) for each in zip(*self._parts, strict=True))
        return rows, tuple(places)


class QPRows:
    """Constraints least ≤ A y ≤ most in whitened variables y; rows are added at the end.

    Args:
        whitening: W with x = W y, shape (n, k).

    Attributes:
        count: number of rows.
        gradients: gradients of the rows by x, in the order of their addition.
    """

    def __init__(self, whitening: Array) -> None:
        self.whitening, size = whitening, whitening.shape[1]
        self.count = self._transformed = 0
        self.gradients, self._fresh = list[Array](), list[Array]()
        # the first `count` rows are in use
        rows = QP_ROWS.initial_rows
        self._A = np.empty((rows, size))
        self._least, self._most = np.empty(rows), np.empty(rows)
        self._hard, self._active = np.empty(rows, dtype=bool), np.empty(rows, dtype=bool)
        self._identity = np.eye(size)

    def add(
        self,
        gradients: Array,
        most: Array,
        least: Array | float = -_INFINITE,
        hard: bool = False,
        active: Mask | bool = False,
    ) -> Index:
        """Add rows.

        Args:
            gradients: gradients by the scaled variables, shape (rows, n).
            most: upper bounds, shape (rows,).
            least: lower bounds, shape (rows,).
            hard: whether the rows are never relaxed.
            active: guess of the rows that hold with equality, shape (rows,).

        Returns:
            The numbers of the rows, shape (rows,).
        """
        self.gradients.append(gradients)
        self._fresh.append(gradients)
        first, self.count = self.count, self.count + len(most)
        while self.count > len(self._A):
            self._double_memory()
        rows = slice(first, self.count)
        self._least[rows], self._most[rows] = least, most
        self._hard[rows], self._active[rows] = hard, active
        return np.arange(first, self.count)

    def replace_bounds(self, rows: Index, most: Array) -> None:
        """Replace the upper bounds (rows,) of rows."""
        self._most[rows] = most

    def _double_memory(self) -> None:
        """Allocate memory for twice as many rows."""
        for name in ("_A", "_least", "_most", "_hard", "_active"):
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old, np.empty_like(old)]))

    def _transform(self) -> None:
        """Whiten the rows added since the last solve, in one product."""
        if self.count > self._transformed:
            rows = slice(self._transformed, self.count)
            np.matmul(np.concatenate(self._fresh), self.whitening, out=self._A[rows])
        self._fresh, self._transformed = [], self.count

    def solve(self, gradient: Array, relax: bool) -> tuple[Array, Array, bool]:
        """Minimise ½ yᵀ y + gradientᵀ y within the rows.

        Args:
            gradient: gradient in the whitened variables, shape (k,).
            relax: whether rows that are not hard may be violated, at a penalty.

        Returns:
            y (k,), the multipliers of the rows (count,), and whether DAQP found a solution.
        """
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
            primal_tol=QP_ROWS.primal_tolerance,
            eps_prox=0.0,
            rho_soft=QP_ROWS.softness,
            iter_limit=QP_ROWS.max_iterations,
            # 0 for no limit
            time_limit=max(left, QP_ROWS.least_time) if np.isfinite(left) else 0.0,
        )
        found = bool(flag >= _DAQP_OPTIMAL)
        if found:
            # active set from which the next solve starts
            active[:] = info["lam"] > 0
        return y, info["lam"], found


class ProgramRows(QPRows):
    """Rows of a `NonlinearProgram`, with their places in it.

    Args:
        whitening: as of `QPRows`.
        grid: numbers (3, r, M) of derivatives, coordinates and grid points.

    Attributes:
        rates: rows of limits on rates, by derivative, coordinate and grid point.
        bounds: rows of bounds of variables, by side and variable.
        path: rows of path constraints, by path point and column.
        chosen: lower and upper limits on rates with a row, shape (2, 3, r, M).
        bounded: lower and upper bounds with a row, shape (2, n).
    """

    def __init__(self, whitening: Array, grid: tuple[int, ...]) -> None:
        super().__init__(whitening)
        self.chosen = np.zeros((2, *grid), dtype=bool)
        self.bounded = np.zeros((2, len(whitening)), dtype=bool)
        self.rates, self.bounds, self.path = PlacedRows(3), PlacedRows(2), PlacedRows(2)

    def add_kinematic(
        self,
        gradients: Array,
        most: Array,
        places: Places,
        upper: Mask,
        active: Mask | bool = False,
    ) -> None:
        """Add `upper` or lower limits on rates at places without such a row; see `add`."""
        self.rates.add(self.add(gradients, most, active=active), places)
        self.chosen[upper.astype(int), *places] = True

    def add_path(
        self, gradients: Array, slack: Array, passed: tuple[Index, Index], active: Mask
    ) -> None:
        """Add path constraints without a row yet; see `add`."""
        self.path.add(self.add(gradients, slack, active=active), passed)

    def add_bounds(self, bounds: Array, wanted: Mask) -> None:
        """Add the `wanted` (2, n) lower and upper bounds of variables without a row yet."""
        sides = np.nonzero(wanted & ~self.bounded)
        side, variable = sides
        gradients = np.zeros((len(side), len(self.whitening)))
        sign = np.where(side, 1.0, -1.0)
        gradients[np.arange(len(side)), variable] = sign
        self.bounds.add(self.add(gradients, sign * bounds[sides], hard=True), sides)
        self.bounded[sides] = True
