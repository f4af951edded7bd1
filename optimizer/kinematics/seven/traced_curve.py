"""A self-motion that is known by points along it: cubics between them, which Newton's method leads
onto the curve.

A member is the configuration of the curve across from the cubic: in the plane through its point at
right angles to the direction there, which goes evenly from one tangent to the next. So the
parameter of a member is found without kinematics, from the cubic alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.seven.across_curve import onto
from joulepath.optimizer.kinematics.seven.curve_tracing import TracedPath
from joulepath.optimizer.kinematics.seven.traced_stack import Rows, TracedStack
from joulepath.optimizer.problem.branches import BranchLabel

# distance [rad] from the cubics within which a member is, and from the curve at which a
# configuration is one
BESIDE, SAME = 0.05, 1e-5
# rounding of an angle on a limit [rad]
ROUNDING = 1e-9
# how much faster [1] a joint may turn between points than on the way from one to the next
FASTER = 1.5


@dataclass(frozen=True, eq=False)
class TracedCurve:
    """`SelfMotion` that holds the flange at T (4, 4), number `row` of the curves of this pose.

    `arcs` are the intervals of its parameter that are meant: all of it, or what is within limits.
    """

    chain: Chain
    T: Array
    stack: TracedStack
    row: int
    label: BranchLabel
    arcs: list[tuple[float, float]]

    @classmethod
    def of(cls, chain: Chain, T: Array, path: TracedPath, label: BranchLabel) -> TracedCurve:
        """The whole curve along a path."""
        stack = TracedStack.of([path])
        half = float(stack.half[0])
        return cls(chain, T, stack, 0, label, [(-half, half)])

    def cut(self, arcs: list[tuple[float, float]]) -> TracedCurve:
        """The same curve on these arcs."""
        return TracedCurve(self.chain, self.T, self.stack, self.row, self.label, arcs)

    @property
    def nodes(self) -> Array:
        """The points (m, nq) [rad] that it is known by, without full turns left out."""
        return self.stack.nodes[self._part]

    @property
    def closed(self) -> bool:
        """Whether it ends where it begins, but for full turns."""
        return bool(self.stack.half[self.row] == np.pi)

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the joints that move."""
        return tuple(np.flatnonzero(np.ptp(self.nodes, axis=0) > ROUNDING).tolist())

    def at(self, parameter: Array) -> Array:
        """The configurations (n, nq) [rad] at parameters (n,) on the arcs."""
        return members([self], [np.asarray(parameter, dtype=float)])[0]

    def parameter(self, q: Array) -> float:
        """The parameter of the member nearest to q (nq,) [rad], nearly."""
        return self.clipped(self._nearest(q)[0])

    def passes(self, q: Array) -> bool:
        """Whether a configuration (nq,) [rad] that holds the pose is a member."""
        parameter, away = self._nearest(q)
        if away > BESIDE:
            return False
        return bool(
            np.abs(wrapped(self.at(np.array([self.clipped(parameter)]))[0] - q)).max() < SAME
        )

    def clipped(self, parameter: float) -> float:
        """The nearest parameter on an arc."""
        found = []
        for lower, upper in self.arcs:
            middle = (lower + upper) / 2
            near = (
                parameter + 2 * np.pi * round((middle - parameter) / (2 * np.pi))
                if self.closed
                else parameter
            )
            on_arc = min(max(near, lower), upper)
            found.append((abs(near - on_arc), on_arc))
        return float(min(found)[1])

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """See `SelfMotion`; by the greatest rate of each joint between nodes.

        No bound rests on this alone: where curves may be missed, bounds cover all configurations.
        """
        centre = self.at(np.asarray(parameter, dtype=float))
        if len(self.nodes) == 1:
            return centre, np.full_like(centre, ROUNDING)
        rates = np.abs(
            np.diff(self.nodes, axis=0) / np.diff(self.stack.knots[self._part])[:, None]
        ).max(axis=0)
        return centre, np.minimum(
            FASTER * np.asarray(half, dtype=float)[:, None] * rates + ROUNDING, np.pi
        )

    @property
    def _part(self) -> slice:
        """The rows of its points."""
        return slice(int(self.stack.first[self.row]), int(self.stack.last[self.row]) + 1)

    def _nearest(self, q: Array) -> tuple[float, float]:
        """The parameter of the point between nodes across from q (nq,), and how far [rad] it is
        from q, or more.
        """
        stack, part = self.stack, self._part
        k: Rows = np.arange(part.start, max(part.stop - 1, part.start + 1))
        unwound = nearest_turn(q, stack.nodes[k])
        ways = np.maximum(stack.ways[k], ROUNDING)
        share = ((unwound - stack.nodes[k]) * stack.tangents[k]).sum(axis=1) / ways
        chosen = (
            np.abs(stack.at(k, np.minimum(np.maximum(share, 0.0), 1.0)) - unwound)
            .max(axis=1)
            .argsort()[:3]
        )
        k, unwound = k[chosen], unwound[chosen]
        share = stack.in_line(k, np.minimum(np.maximum(share[chosen], 0.0), 1.0), unwound)
        # next to a point, rounding may have it beyond the ends of both ways: it is little beyond
        # either
        beyond = np.abs(share - np.minimum(np.maximum(share, 0.0), 1.0)) * ways[chosen]
        away = np.abs(stack.at(k, share) - unwound).max(axis=1) + beyond
        best = int(away.argmin())
        after = min(int(k[best]) + 1, part.stop - 1)
        low, high = stack.knots[k[best]], stack.knots[after]
        return float(low + share[best] * (high - low)), float(away[best])


def members(curves: Sequence[TracedCurve], parameters: Sequence[Array]) -> list[Array]:
    """The configurations (n, nq) [rad] of each of the curves of one pose at its parameters (n,)."""
    one, counts = curves[0], [len(at) for at in parameters]
    rows = np.repeat([curve.row for curve in curves], counts)
    k, share = one.stack.pieces(np.concatenate(parameters), rows)
    return np.split(on_curve(one, k, share), np.cumsum(counts)[:-1])


def on_curve(one: TracedCurve, k: Rows, share: Array) -> Array:
    """The members (n, nq) [rad] across from the cubics at shares (n,) of the ways from points k
    (n,) to the next ones. `one` is any curve of the pose."""
    q = onto(one.chain, one.stack.at(k, share), one.stack.along(k, share), one.T)
    # np.clip takes five times as long for so few
    return np.asarray(np.minimum(np.maximum(wrapped(q), -np.pi), np.pi))
