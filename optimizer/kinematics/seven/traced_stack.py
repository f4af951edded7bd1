"""Curves that are known by points along them, all of one pose: cubics between the points, end to
end in one array.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.seven.curve_tracing import TracedPath
from joulepath.optimizer.kinematics.seven.hermite import hermite

# half the range of the parameter of a curve with two ends: no full turn, whose ends would be one
OPEN = 3.0
# steps that find where a cubic is across from a configuration, the share beyond its ends that they
# may go to, and the step whose square is none
STEPS, BEYOND, IN_LINE = 8, 0.25, 1e-8
# distance [rad] from the way between two points within which a curve is
BESIDE = 0.15
# length [rad] of no curve
NONE = 1e-300

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TracedStack:
    """Points `nodes` (n, nq) [rad] along curves, one curve after the other, with unit `tangents`
    (n, nq).

    `first` (m,) is the row of the first point of each curve. `half` (m,) is half the range of its
    parameter, which goes evenly with its length: from -π to π once around, or from -OPEN to OPEN; 0
    for a curve of one point.
    """

    nodes: Array
    tangents: Array
    first: Rows
    half: Array

    @classmethod
    def of(cls, paths: Sequence[TracedPath]) -> TracedStack:
        """The curves along paths."""
        if not paths:
            return cls(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0, dtype=np.intp), np.zeros(0))
        counts = [len(path.q) for path in paths]
        half = [
            np.pi if path.closed else OPEN if count > 1 else 0.0
            for path, count in zip(paths, counts, strict=True)
        ]
        nodes, tangents = (
            np.concatenate([path.q for path in paths]),
            np.concatenate([path.tangents for path in paths]),
        )
        return cls(nodes, tangents, np.cumsum([0, *counts[:-1]]), np.array(half))

    def joined(self, paths: Sequence[TracedPath]) -> TracedStack:
        """These curves, then those along paths."""
        if not paths:
            return self
        others = TracedStack.of(paths)
        if not len(self.first):
            return others
        return TracedStack(
            np.concatenate([self.nodes, others.nodes]),
            np.concatenate([self.tangents, others.tangents]),
            np.concatenate([self.first, others.first + len(self.nodes)]),
            np.concatenate([self.half, others.half]),
        )

    @cached_property
    def last(self) -> Rows:
        """The row (m,) of the last point of each curve."""
        return np.append(self.first[1:], len(self.nodes)) - 1

    @cached_property
    def ways(self) -> Array:
        """Lengths (n,) [rad] of the steps from each point to the next of its curve; 0 at the
        last."""
        ways = np.zeros(len(self.nodes))
        ways[:-1] = np.linalg.norm(self.nodes[1:] - self.nodes[:-1], axis=1)
        ways[self.last] = 0.0
        return ways

    @cached_property
    def lengths(self) -> Array:
        """Lengths (m,) [rad] of the curves."""
        return np.add.reduceat(self.ways, self.first)

    @cached_property
    def knots(self) -> Array:
        """The parameters (n,) of the points."""
        counts = self.last - self.first + 1
        along = np.append(0.0, np.cumsum(self.ways[:-1]))
        along -= np.repeat(along[self.first], counts)
        scale = np.repeat(2 * self.half / np.maximum(self.lengths, NONE), counts)
        return np.asarray(scale * along - np.repeat(self.half, counts))

    def pieces(self, u: Array, curves: Rows) -> tuple[Rows, Array]:
        """The rows (n,) of the points before parameters u (n,) of curves (n,), and the shares (n,)
        of the way to the next points."""
        wide = 4 * OPEN
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
        """The points after points k (n,); of one with no way to it, the same."""
        return np.asarray(k + (self.ways[k] > 0))

    def at(self, k: Rows, share: Array) -> Array:
        """Points (n, nq) [rad] at shares (n,) of the ways from points k (n,) to the next ones."""
        after, way = self._after(k), self.ways[k][:, None]
        return hermite(
            share,
            self.nodes[k],
            self.nodes[after],
            way * self.tangents[k],
            way * self.tangents[after],
        )

    def at_each(self, k: Rows, weights: Array, joints: Rows) -> Array:
        """Angles (n, m, j) [rad] of some joints (j,) at each of m shares of the ways from points k
        (n,) to the next ones, by the `hermite_weights` (4, m) of these shares."""
        after, way = self._after(k), self.ways[k][:, None]
        ends = np.empty((len(k), 4, self.nodes.shape[1]))
        ends[:, 0], ends[:, 1] = self.nodes[k], self.nodes[after]
        ends[:, 2], ends[:, 3] = way * self.tangents[k], way * self.tangents[after]
        return np.asarray(weights.T @ ends[:, :, joints])

    def along(self, k: Rows, share: Array) -> Array:
        """Directions (n, nq) of the curves there, nearly: members are sought across them."""
        before = self.tangents[k]
        return before + share[:, None] * (self.tangents[self._after(k)] - before)

    def in_line(self, k: Rows, share: Array, q: Array) -> Array:
        """The shares (n,), next to those given, at which configurations q (n, nq) [rad] are across
        from the curves: across the direction `along` there. Of ways of no length, those given."""
        way, after = self.ways[k], self._after(k)
        sides = np.empty((4, *q.shape))
        t, bend, chord, away = sides
        t[:], bend[:] = self.tangents[k], self.tangents[after]
        bend -= t
        np.subtract(self.nodes[after], self.nodes[k], out=chord)
        np.subtract(q, self.nodes[k], out=away)
        (tt, _), (tb, bb), (tc, bc), (e0, e1) = np.einsum("xij,yij->xyi", sides, sides[:2])
        # the cubic is node + a s + b s² + c s³ with a = way t, b = 3 chord - way (3 t + bend), c =
        # way (2 t + bend) - 2 chord; what is sought is a zero of a quartic
        e1 = e1 - way * tt
        e2 = way * (3 * tt) - 3 * tc
        e3 = way * (2 * tb + bb - 2 * tt) + 2 * tc - 3 * bc
        e4 = 2 * bc - way * (2 * tb + bb)
        moving = way > 0
        least = -np.maximum(way, NONE)
        for _ in range(STEPS):
            value = e0 + share * (e1 + share * (e2 + share * (e3 + share * e4)))
            slope = e1 + share * (2 * e2 + share * (3 * e3 + share * (4 * e4)))
            step = value / np.where(slope < 0, slope, least)
            share = np.where(
                moving, np.minimum(np.maximum(share - step, -BEYOND), 1 + BEYOND), share
            )
            if np.abs(step).max(initial=0.0) < IN_LINE:
                break
        return np.asarray(share)

    def places_and_near(self) -> tuple[Array, Mask]:
        """Numbers (m,) that tell where curves are, but not where they start: they are ordered by
        them. And near which others (m, m) the first point of each is: only on these may it be.

        The number is the mean of a sum of waves along the curve, which full turns do not change.
        """
        # one phase for each joint, so that mirrored curves differ
        m, nq = self.nodes.shape
        phases, waves = self.nodes + np.arange(1.0, nq + 1), np.empty((m, 2 * nq))
        c, s = np.cos(phases, out=waves[:, :nq]), np.sin(phases, out=waves[:, nq:])
        wave, slope = s.sum(axis=1), np.einsum("ij,ij->i", c, self.tangents)
        # the trapezoidal rule with its end correction
        parts, way = np.zeros(len(wave)), self.ways[:-1]
        parts[:-1] = way / 2 * (wave[1:] + wave[:-1]) - way**2 / 12 * (slope[1:] - slope[:-1])
        total = np.add.reduceat(parts, self.first)
        places = np.where(
            self.lengths > 0, total / np.maximum(self.lengths, NONE), wave[self.first]
        )
        # at a distance d, the sum of the cosines of all angles between is no less than their number
        # less d²/2
        alike = np.maximum.reduceat(waves[self.first] @ waves.T, self.first, axis=1)
        far = np.maximum.reduceat(self.ways, self.first) + BESIDE
        return places, alike >= nq - far**2 / 2
