"""The cells of a grid over two joints around a path.

A value at a point of a cell is at least the least value at the cell's corners, less Σ h² / 8 ·
(bound on the second derivative along the side h) over both sides: interpolation along one side errs
by no more than that, and does not increase the other's second derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.native.shared_library import address, library


@dataclass(frozen=True)
class Curvature:
    """Bounds on a term's change that its corners do not show: `along` (S, ...) is 1/8 of the second
    derivative over a step, `across` (S, 2, ...) the second derivatives by the grid's joints
    [1/rad²]."""

    along: Array
    across: Array


@dataclass(frozen=True)
class Spacing:
    """Distance of the points next to the path [rad], and its growth from one interval to the next
    outwards.
    """

    first: float = 0.16
    growth: float = 1.25

    def axis(self, half: float) -> Array:
        """Positions [rad] from -half to half, with 0 in the middle, closer near 0."""
        nodes, spacing = [0.0], self.first
        while nodes[-1] < half:
            nodes.append(nodes[-1] + spacing)
            spacing *= self.growth
        positive = np.array(nodes) * (half / nodes[-1])
        return np.concatenate([-positive[:0:-1], positive])


@dataclass(frozen=True)
class GridCells:
    """The grid of two `axes` (n,) and (m,) [rad]: values of n · m points, and of (n - 1) · (m - 1)
    cells, in rows.
    """

    axes: tuple[Array, Array]

    @property
    def centre(self) -> int:
        """The point on the path."""
        return len(self.axes[0]) * len(self.axes[1]) // 2

    @property
    def count(self) -> int:
        """Number of cells."""
        return (len(self.axes[0]) - 1) * (len(self.axes[1]) - 1)

    def points(self) -> Array:
        """Positions (n · m, 2) [rad]."""
        return np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1).reshape(-1, 2)

    def deviation(
        self, value: Array, mean: Array, curvature: Curvature, joints: Sequence[int]
    ) -> Array:
        """Bounds (S, 2, cells, k) on how far values of k joints are from their means (S, nq), in
        each cell and along each step; `value` (S, 2, points, nq) has those of both ends of a step.
        """
        at = np.array(joints)
        S, nq = mean.shape
        result = np.empty((S, 2, self.count, len(at)))
        given = *self.axes, at, value, mean, curvature.along, curvature.across
        plain = [np.ascontiguousarray(each) for each in given]
        library.cell_deviation(
            S, nq, *map(len, self.axes), len(at), *map(address, (*plain, result))
        )
        return result

    def beyond(self, half: Array) -> Array:
        """inf for the cells (S, cells) beyond boxes of these half sides (S, 2) [rad], where no
        motion is, else 0.
        """
        nearest = [np.minimum(np.abs(axis[:-1]), np.abs(axis[1:])) for axis in self.axes]
        outside = (nearest[0] > half[:, :1])[:, :, None] | (nearest[1] > half[:, 1:])[:, None]
        return np.where(outside, np.inf, 0.0).reshape(len(half), -1)

    def needed(self, half: Array) -> Mask:
        """The points (S + 1, points) that are corners of a cell within the boxes of a step beside a
        node.
        """
        n, m = map(len, self.axes)
        within = (self.beyond(half) == 0).reshape(len(half), n - 1, m - 1)
        near = np.zeros((len(half) + 1, n, m), dtype=bool)
        for nodes in (near[:-1], near[1:]):
            for rows in (nodes[:, :-1], nodes[:, 1:]):
                rows[:, :, :-1] |= within
                rows[:, :, 1:] |= within
        return near.reshape(len(near), -1)
