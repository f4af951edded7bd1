"""Traced curves of one pose, stacked in one array: points with cubics between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.seven.curve_tracing import TracedPath
from joulepath.optimizer.kinematics.seven.hermite import hermite


@dataclass(frozen=True)
class StackSettings:
    """Parameters of open curves, and the search across cubics."""

    open_half: float = 3.0
    """Half the range of the parameter of an open curve: less than π, so that its ends differ."""
    steps: int = 40
    """Largest number of steps towards the point of a cubic across from a configuration."""
    beyond: float = 0.25
    """Largest share beyond the ends of a segment in this search."""
    tolerance: float = 1e-12
    """Step at which the search ends, relative to the segment."""
    beside: float = 0.15
    """Largest distance of a curve from the segment between two of its points [rad]."""
    least_length: float = 1e-300
    """Smallest length that divides [rad]."""


SETTINGS = StackSettings()

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TracedCurveStack:
    """Traced curves of one pose, one after the other.

    The parameter of a curve is proportional to its arc length.
    """

    nodes: Array
    """Points along the curves, shape (n, nq) [rad]."""
    tangents: Array
    """Unit tangents at the points, shape (n, nq)."""
    first: Rows
    """Row of the first point by curve, shape (m,)."""
    half: Array
    """Half the range of the parameter by curve, shape (m,): π for a closed curve, `open_half` for
    an open curve, 0 for a single point."""

    @classmethod
    def of(cls, paths: Sequence[TracedPath]) -> TracedCurveStack:
        """Stack of the curves along paths."""
        counts = [len(path.q) for path in paths]
        half = [
            np.pi if path.closed else SETTINGS.open_half if count > 1 else 0.0
            for path, count in zip(paths, counts, strict=True)
        ]
        nodes = np.concatenate([path.q for path in paths])
        tangents = np.concatenate([path.tangents for path in paths])
        return cls(nodes, tangents, np.cumsum([0, *counts[:-1]]), np.array(half))

    @cached_property
    def last(self) -> Rows:
        """Row of the last point by curve, shape (m,)."""
        return np.append(self.first[1:], len(self.nodes)) - 1

    @cached_property
    def segment_lengths(self) -> Array:
        """Lengths of the segments from the points to their successors, shape (n,) [rad]; 0 at the
        last point of a curve.
        """
        lengths = np.zeros(len(self.nodes))
        lengths[:-1] = np.linalg.norm(self.nodes[1:] - self.nodes[:-1], axis=1)
        lengths[self.last] = 0.0
        return lengths

    @cached_property
    def curve_lengths(self) -> Array:
        """Lengths (m,) [rad] of the curves."""
        return np.add.reduceat(self.segment_lengths, self.first)

    @cached_property
    def knots(self) -> Array:
        """Parameters (n,) of the points."""
        counts = self.last - self.first + 1
        along = np.append(0.0, np.cumsum(self.segment_lengths[:-1]))
        along -= np.repeat(along[self.first], counts)
        scale = np.repeat(
            2 * self.half / np.maximum(self.curve_lengths, SETTINGS.least_length), counts
        )
        return np.asarray(scale * along - np.repeat(self.half, counts))

    def locate(self, u: Array, curves: Rows) -> tuple[Rows, Array]:
        """Find the segments at given parameters.

        Args:
            u: parameters, shape (n,).
            curves: numbers of the curves, shape (n,).

        Returns:
            Rows of the first points of the segments, and shares of the segments, both (n,).
        """
        wide = 4 * SETTINGS.open_half
        turn = 2 * np.pi * np.round(u / (2 * np.pi))
        u = np.where(self.half[curves] == np.pi, u - turn, u)
        shifted = self.knots + wide * np.repeat(
            np.arange(len(self.first)), self.last - self.first + 1
        )
        k = np.searchsorted(shifted, u + wide * curves, side="right") - 1
        k = np.minimum(
            np.maximum(k, self.first[curves]), np.maximum(self.last[curves] - 1, self.first[curves])
        )
        after = np.minimum(k + 1, self.last[curves])
        gap = self.knots[after] - self.knots[k]
        return k, (u - self.knots[k]) / np.where(gap > 0, gap, 1.0)

    def _after(self, k: Rows) -> Rows:
        """Next points of points k (n,); the last point of a curve is its own successor."""
        return np.asarray(k + (self.segment_lengths[k] > 0))

    def at(self, k: Rows, share: Array) -> Array:
        """Points (n, nq) [rad] at shares (n,) of the segments with first points k (n,)."""
        after, length = self._after(k), self.segment_lengths[k][:, None]
        return hermite(
            share,
            self.nodes[k],
            self.nodes[after],
            length * self.tangents[k],
            length * self.tangents[after],
        )

    def at_each(self, k: Rows, weights: Array, joints: Rows) -> Array:
        """Angles (n, m, j) [rad] of joints (j,) at m common shares of the segments.

        Args:
            k: first points of the segments, shape (n,).
            weights: `hermite_weights` of the shares, shape (4, m).
            joints: indices of the joints, shape (j,).
        """
        after, length = self._after(k), self.segment_lengths[k][:, None]
        ends = np.empty((len(k), 4, self.nodes.shape[1]))
        ends[:, 0], ends[:, 1] = self.nodes[k], self.nodes[after]
        ends[:, 2], ends[:, 3] = length * self.tangents[k], length * self.tangents[after]
        return np.asarray(weights.T @ ends[:, :, joints])

    def along(self, k: Rows, share: Array) -> Array:
        """Approximate directions of the curves at shares of segments, shape (n, nq)."""
        before = self.tangents[k]
        return before + share[:, None] * (self.tangents[self._after(k)] - before)

    def shares_across(self, k: Rows, share: Array, q: Array) -> Array:
        """Project configurations on the curves, near given shares.

        At the projection, the difference between the configuration and the point of the curve is
        perpendicular to the direction `along`. Shares of segments of length zero do not change.

        Args:
            k: first points of the segments, shape (n,).
            share: shares of the segments to begin with, shape (n,).
            q: configurations, shape (n, nq) [rad].

        Returns:
            Shares of the projections, shape (n,).
        """
        length = self.segment_lengths[k]
        moving, scale = length > 0, np.maximum(length, SETTINGS.least_length)
        for _ in range(SETTINGS.steps):
            ahead = ((q - self.at(k, share)) * self.along(k, share)).sum(axis=1)
            near = np.clip(share + ahead / scale, -SETTINGS.beyond, 1 + SETTINGS.beyond)
            before, share = share, np.where(moving, near, share)
            if np.abs(share - before).max(initial=0.0) < SETTINGS.tolerance:
                break
        return share

    def order_and_neighbours(self) -> tuple[Array, Mask]:
        """Order the curves, and find the curves near their first points.

        The key of the order is the mean of a sum of sines along a curve. It is invariant under full
        turns and under the choice of the first point of a closed curve.

        Returns:
            Keys (m,), and a mask (m, m): entry (i, j) is true if curve j may pass the first point
            of curve i.
        """
        # a phase per joint distinguishes mirrored curves
        m, nq = self.nodes.shape
        phases, cosines_and_sines = self.nodes + np.arange(1.0, nq + 1), np.empty((m, 2 * nq))
        c = np.cos(phases, out=cosines_and_sines[:, :nq])
        s = np.sin(phases, out=cosines_and_sines[:, nq:])
        sine_sum, slope = s.sum(axis=1), np.einsum("ij,ij->i", c, self.tangents)
        # Trapezoidal rule with its end correction.
        parts, length = np.zeros(len(sine_sum)), self.segment_lengths[:-1]
        parts[:-1] = length / 2 * (sine_sum[1:] + sine_sum[:-1]) - length**2 / 12 * (
            slope[1:] - slope[:-1]
        )
        total = np.add.reduceat(parts, self.first)
        order = np.where(
            self.curve_lengths > 0,
            total / np.maximum(self.curve_lengths, SETTINGS.least_length),
            sine_sum[self.first],
        )
        # At a distance d, the sum of the cosines of all joint distances is at least nq - d²/2.
        cosine_sums = np.maximum.reduceat(
            cosines_and_sines[self.first] @ cosines_and_sines.T, self.first, axis=1
        )
        far = np.maximum.reduceat(self.segment_lengths, self.first) + SETTINGS.beside
        return order, cosine_sums >= nq - far**2 / 2
