"""Self-motion represented by points along the curve, with cubics between the points.

Newton's method projects a point of a cubic onto the curve. It moves in the plane through this point
perpendicular to a direction; the direction changes linearly from one tangent to the next. The
result is a member of the curve. Its parameter is the parameter of the point on the cubic, without
kinematics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.self_motion import nearest_on_arcs
from joulepath.optimizer.kinematics.seven.across_curve import project_across
from joulepath.optimizer.kinematics.seven.curve_tracing import TracedPath
from joulepath.optimizer.kinematics.seven.traced_curve_stack import Rows, TracedCurveStack
from joulepath.optimizer.problem.branches import BranchLabel


@dataclass(frozen=True)
class TracedCurveSettings:
    """Tolerances of members and margins of boxes."""

    beside: float = 0.05
    """Largest joint distance of a member from the cubics [rad]."""
    same: float = 1e-5
    """Largest joint distance of a configuration on the curve from its member [rad]."""
    rounding: float = 1e-9
    """Angle that is due to rounding [rad]."""
    rate_factor: float = 1.5
    """Factor of the largest rate of a joint between nodes, which bounds its rate on the curve."""


SETTINGS = TracedCurveSettings()


@dataclass(frozen=True, eq=False)
class TracedCurve:
    """`SelfMotion` of the flange pose T (4, 4), in row `row` of the curves of this pose.

    `arcs` are the intervals of its parameter: all of it, or the part within limits.
    """

    chain: Chain
    T: Array
    stack: TracedCurveStack
    row: int
    label: BranchLabel
    arcs: list[tuple[float, float]]

    @classmethod
    def of(cls, chain: Chain, T: Array, path: TracedPath, label: BranchLabel) -> TracedCurve:
        """The whole curve along a path."""
        stack = TracedCurveStack.of([path])
        half = float(stack.half[0])
        return cls(chain, T, stack, 0, label, [(-half, half)])

    def cut(self, arcs: list[tuple[float, float]]) -> TracedCurve:
        """The same curve on other arcs."""
        return TracedCurve(self.chain, self.T, self.stack, self.row, self.label, arcs)

    @property
    def nodes(self) -> Array:
        """Known points (m, nq) [rad] of the curve, without jumps by full turns."""
        return self.stack.nodes[self._part]

    @property
    def closed(self) -> bool:
        """Whether the curve ends at its start, up to full turns."""
        return bool(self.stack.half[self.row] == np.pi)

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the moving joints."""
        return tuple(np.flatnonzero(np.ptp(self.nodes, axis=0) > SETTINGS.rounding).tolist())

    def at(self, parameter: Array) -> Array:
        """Configurations (n, nq) [rad] at parameters (n,) on the arcs."""
        return members([self], [np.asarray(parameter, dtype=float)])[0]

    def parameter(self, q: Array) -> float:
        """Parameter of the member nearest to q (nq,) [rad], approximately."""
        return self.clipped(self._nearest(q)[0])

    def passes(self, q: Array) -> bool:
        """Whether a configuration (nq,) [rad] of the pose is a member."""
        parameter, away = self._nearest(q)
        if away > SETTINGS.beside:
            return False
        return bool(
            np.abs(wrapped(self.at(np.array([self.clipped(parameter)]))[0] - q)).max()
            < SETTINGS.same
        )

    def clipped(self, parameter: float) -> float:
        """Nearest parameter on an arc."""
        return nearest_on_arcs(parameter, self.arcs, self.closed)

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes around the curve, see `SelfMotion.boxes`, from the largest joint rates between
        nodes.

        No bound depends on these boxes alone: if curves may be missed, bounds cover all
        configurations.
        """
        centre = self.at(np.asarray(parameter, dtype=float))
        if len(self.nodes) == 1:
            return centre, np.full_like(centre, SETTINGS.rounding)
        rates = np.abs(
            np.diff(self.nodes, axis=0) / np.diff(self.stack.knots[self._part])[:, None]
        ).max(axis=0)
        return centre, np.minimum(
            SETTINGS.rate_factor * np.asarray(half, dtype=float)[:, None] * rates
            + SETTINGS.rounding,
            np.pi,
        )

    @property
    def _part(self) -> slice:
        """Rows of the points of the curve."""
        return slice(int(self.stack.first[self.row]), int(self.stack.last[self.row]) + 1)

    def _nearest(self, q: Array) -> tuple[float, float]:
        """Parameter of the point between nodes across from q (nq,), and an upper bound of its
        distance [rad].
        """
        stack, part = self.stack, self._part
        k: Rows = np.arange(part.start, max(part.stop - 1, part.start + 1))
        unwound = nearest_turn(q, stack.nodes[k])
        lengths = np.maximum(stack.segment_lengths[k], SETTINGS.rounding)
        share = ((unwound - stack.nodes[k]) * stack.tangents[k]).sum(axis=1) / lengths
        chosen = (
            np.abs(stack.at(k, np.minimum(np.maximum(share, 0.0), 1.0)) - unwound)
            .max(axis=1)
            .argsort()[:3]
        )
        k, unwound = k[chosen], unwound[chosen]
        share = stack.shares_across(k, np.minimum(np.maximum(share[chosen], 0.0), 1.0), unwound)
        # Next to a node, rounding may place the point slightly beyond the ends of both segments.
        beyond = np.abs(share - np.minimum(np.maximum(share, 0.0), 1.0)) * lengths[chosen]
        away = np.abs(stack.at(k, share) - unwound).max(axis=1) + beyond
        best = int(away.argmin())
        after = min(int(k[best]) + 1, part.stop - 1)
        low, high = stack.knots[k[best]], stack.knots[after]
        return float(low + share[best] * (high - low)), float(away[best])


def members(curves: Sequence[TracedCurve], parameters: Sequence[Array]) -> list[Array]:
    """Configurations (n, nq) [rad] of curves of one pose, at parameters (n,) per curve."""
    one, counts = curves[0], [len(at) for at in parameters]
    rows = np.repeat([curve.row for curve in curves], counts)
    k, share = one.stack.locate(np.concatenate(parameters), rows)
    return np.split(on_curve(one, k, share), np.cumsum(counts)[:-1])


def on_curve(one: TracedCurve, k: Rows, share: Array) -> Array:
    """Members (n, nq) [rad] at shares (n,) of the segments after the points k (n,).

    `one` is any curve of the pose.
    """
    q = project_across(one.chain, one.stack.at(k, share), one.stack.along(k, share), one.T)
    # np.clip takes five times as long for so few numbers.
    return np.asarray(np.minimum(np.maximum(wrapped(q), -np.pi), np.pi))
