"""Cells of a grid over two joints around a path.

A value at a point of a cell is at least the least value at the corners of the cell, less Σ h² / 8 ·
(bound on the second derivative along the side h) over both sides. For interpolation along one side
errs by at most this, and does not increase the second derivatives along the other side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.native.shared_library import address, library


@dataclass(frozen=True)
class Curvature:
    """Bounds on the change of a term between the corners of cells."""

    along: Array
    """1 / 8 of the second derivative over a step of the path, shape (S, ...)."""
    across: Array
    """Second derivatives by the joints of the grid, shape (S, 2, ...) [1/rad²]."""


@dataclass(frozen=True)
class Spacing:
    """Spacing of the points of a grid, which grows outwards."""

    first: float = 0.16
    """Distance of the points next to the path [rad]."""
    growth: float = 1.25
    """Ratio of an interval to the interval before it."""

    def axis(self, half: float) -> Array:
        """Positions from -half to half [rad] with 0 in the middle."""
        nodes, spacing = [0.0], self.first
        while nodes[-1] < half:
            nodes.append(nodes[-1] + spacing)
            spacing *= self.growth
        positive = np.array(nodes) * (half / nodes[-1])
        return np.concatenate([-positive[:0:-1], positive])


@dataclass(frozen=True)
class GridCells:
    """The cells of a grid with two axes; points and cells are numbered row by row."""

    axes: tuple[Array, Array]
    """Positions along both joints, shapes (n,) and (m,) [rad]."""

    @property
    def centre(self) -> int:
        """Index of the point on the path."""
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
        """Bounds on the deviation of values from their means, shape (S, 2, cells, k).

        Args:
            value: values at the points at both ends of each step, shape (S, 2, points, nq).
            mean: means, shape (S, nq).
            curvature: bounds on the change of the values between the points.
            joints: the k joints of interest.
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
        """inf for the cells outside of boxes, which no motion reaches, else 0; shape (S, cells).

        Args:
            half: half sides of the boxes, shape (S, 2) [rad].
        """
        nearest = [np.minimum(np.abs(axis[:-1]), np.abs(axis[1:])) for axis in self.axes]
        outside = (nearest[0] > half[:, :1])[:, :, None] | (nearest[1] > half[:, 1:])[:, None]
        return np.where(outside, np.inf, 0.0).reshape(len(half), -1)

    def needed(self, half: Array) -> Mask:
        """Whether a point is a corner of a cell within the boxes of a step beside a node, (S + 1,
        points).
        """
        n, m = map(len, self.axes)
        within = (self.beyond(half) == 0).reshape(len(half), n - 1, m - 1)
        near = np.zeros((len(half) + 1, n, m), dtype=bool)
        for nodes in (near[:-1], near[1:]):
            for rows in (nodes[:, :-1], nodes[:, 1:]):
                rows[:, :, :-1] |= within
                rows[:, :, 1:] |= within
        return near.reshape(len(near), -1)
