"""Hessians by the free control points of B-splines, as blocks of pairs and as bands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE
from joulepath.optimizer.solve.nlp.active_path_constraints import Index


@dataclass(frozen=True)
class ControlPointPairs:
    """Pairs i ≤ j of free control points that move a common span.

    Variables are ordered row by row. A Hessian has a block (r, r) per pair. Its lower band (m r,
    band + 1) has the columns as rows.
    """

    m: int
    """Number of free control points."""

    r: int
    """Number of coordinates."""

    @cached_property
    def pairs(self) -> tuple[Index, Index]:
        """Indices i and j of all pairs."""
        apart = np.subtract.outer(np.arange(self.m), np.arange(self.m))
        i, j = np.nonzero((apart <= 0) & (apart >= -DEGREE))
        return i, j

    @cached_property
    def own(self) -> Index:
        """The pairs of a control point with itself."""
        return np.flatnonzero(self.pairs[0] == self.pairs[1])

    @property
    def band(self) -> int:
        """Number of diagonals below the main one."""
        return min((DEGREE + 1) * self.r, self.m * self.r) - 1

    def products(self, rows: Array) -> Array:
        """Products (pairs, k) of the entries of rows (k, m): the blocks of squared rows."""
        i, j = self.pairs
        return np.ascontiguousarray((rows[:, i] * rows[:, j]).T)

    def node_products(self, rows: Array) -> Array:
        """Products (pairs, 9 N) of the rows (3 N, m) of q, v and a, two by two at every node."""
        i, j = self.pairs
        three = rows.reshape(-1, 3, self.m)
        return np.ascontiguousarray(
            (three[:, :, None, i] * three[:, None, :, j]).reshape(-1, len(i)).T
        )

    def banded(self, blocks: Array) -> Array:
        """Lower bands (..., m r, band + 1) of Hessians by their blocks (..., pairs, r, r)."""
        kept, at = self._band_places
        before = blocks.shape[:-3]
        band = np.zeros((*before, self.m * self.r * (self.band + 1)))
        band[..., at] = blocks.reshape(*before, -1)[..., kept]
        return band.reshape(*before, self.m * self.r, self.band + 1)

    @cached_property
    def _band_places(self) -> tuple[Index, Index]:
        """Entries of the blocks on or below the diagonal, and their places in the band."""
        (i, j), joints = self.pairs, np.arange(self.r)
        rows, columns = np.broadcast_arrays(
            j[:, None, None] * self.r + joints, i[:, None, None] * self.r + joints[:, None]
        )
        below = (rows - columns).ravel()
        kept = np.flatnonzero(below >= 0)
        return kept, (columns.ravel() * (self.band + 1) + below)[kept]
