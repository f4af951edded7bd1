"""A self-motion that is known by points along it: cubics between them, which Newton's method leads onto the curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.robot import Array
from optimizer.kinematics.angles import wrapped
from optimizer.kinematics.chain import Chain, miss, pose_error
from optimizer.kinematics.curve_tracing import TracedPath
from optimizer.kinematics.hermite import hermite
from optimizer.problem.branches import BranchLabel

# half the range of the parameter of a curve with two ends: no full turn, whose ends would be one
OPEN = 3.0
# Newton steps onto the curve, the error [m, rad] that needs no more, and what is added to J Jᵀ there
CORRECTIONS, EXACT, DAMPING = 4, 1e-14, 1e-18
# steps that find the member nearest to a configuration, the distance [rad] that needs no more, and the difference of
# parameters for its derivative
NEAREST, FOUND, STEP = 6, 1e-10, 1e-6
# distance [rad] from the cubics within which a member is, and from the curve at which a configuration is one
BESIDE, SAME = 0.05, 1e-5
# rounding of an angle on a limit [rad]
ROUNDING = 1e-9
# how much faster [1] a joint may turn between points than on the way from one to the next
FASTER = 1.5


@dataclass(frozen=True, eq=False)
class TracedCurve:
    """`SelfMotion` by configurations `nodes` (m, nq) [rad] with unit `tangents` (m, nq) at parameters `knots` (m,).

    The parameter goes evenly with the length of the curve: from -π to π once around, or from -OPEN to OPEN.
    `arcs` are the intervals of it that are meant: all of it, or what is within limits.
    """

    chain: Chain
    T: Array
    nodes: Array
    tangents: Array
    knots: Array
    closed: bool
    label: BranchLabel
    arcs: list[tuple[float, float]]

    @classmethod
    def of(cls, chain: Chain, T: Array, path: TracedPath, label: BranchLabel) -> TracedCurve:
        """The whole curve, which holds the flange at T (4, 4)."""
        nodes = np.array(path.q)
        length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(nodes, axis=0), axis=1)))
        half = np.pi if path.closed else OPEN if len(nodes) > 1 else 0.0
        knots = half * (2 * length / max(length[-1], 1e-300) - 1)
        return cls(chain, T, nodes, np.array(path.tangents), knots, path.closed, label, [(-half, half)])

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the joints that move."""
        return tuple(np.flatnonzero(np.ptp(self.nodes, axis=0) > ROUNDING).tolist())

    def at(self, parameter: Array) -> Array:
        """The configurations (n, nq) [rad] at parameters (n,) on the arcs."""
        return self.onto(self.nearly(np.asarray(parameter, dtype=float)))

    def onto(self, q: Array) -> Array:
        """Configurations (n, nq) [rad] that hold the pose, nearest to such as nearly do."""
        q = q.copy()
        rows = np.arange(len(q))
        for _ in range(CORRECTIONS):
            T_reached, jacobian = self.chain.flange_and_jacobian(q[rows])
            error = pose_error(T_reached, self.T)
            off = miss(error) > EXACT
            rows, error, jacobian = rows[off], error[off], jacobian[off]
            if not len(rows):
                break
            across = jacobian.transpose(0, 2, 1)
            square = jacobian @ across + DAMPING * np.eye(6)
            q[rows] += (across @ np.linalg.solve(square, error[:, :, None]))[:, :, 0]
        return np.clip(wrapped(q), -np.pi, np.pi)

    def nearly(self, u: Array) -> Array:
        """The curve (n, nq) [rad] at parameters (n,), without Newton's method."""
        if len(self.knots) == 1:
            return np.repeat(self.nodes, len(u), axis=0)
        if self.closed:
            u = wrapped(u)
        k = np.clip(np.searchsorted(self.knots, u, side="right") - 1, 0, len(self.knots) - 2)
        share = (u - self.knots[k]) / (self.knots[k + 1] - self.knots[k])
        return self._on_piece(k, share)

    def _on_piece(self, k: NDArray[np.intp], share: Array) -> Array:
        """Points (n, nq) [rad] at shares (n,) of pieces k (n,) of the curve."""
        q0, q1 = self.nodes[k], self.nodes[k + 1]
        way = np.linalg.norm(q1 - q0, axis=1)[:, None]
        return hermite(share, q0, q1, way * self.tangents[k], way * self.tangents[k + 1])

    def parameter(self, q: Array) -> float:
        """The parameter of the member nearest to q (nq,) [rad], nearly."""
        u = self._nearest(q)
        best, least = u, np.inf
        for _ in range(NEAREST):
            before, here, after = self.at(np.array([u - STEP, u, u + STEP]))
            gap = wrapped(q - here)
            away = float(np.abs(gap).max())
            if away < least:
                best, least = u, away
            tangent = wrapped(after - before) / (2 * STEP)
            if away < FOUND or not tangent.any():
                break
            u = self.clipped(u + float(tangent @ gap) / float(tangent @ tangent))
        return best

    def passes(self, q: Array) -> bool:
        """Whether a configuration (nq,) [rad] that holds the pose is a member."""
        if len(self.nodes) > 1:
            steps, away = np.diff(self.nodes, axis=0), wrapped(q - self.nodes)
            if np.sqrt((away * away).sum(axis=1).min()) > np.sqrt((steps * steps).sum(axis=1).max()) + BESIDE:
                return False
        nearly = self.nearly(np.array([self._nearest(q)]))[0]
        if np.abs(wrapped(nearly - q)).max() > BESIDE:
            return False
        return bool(np.abs(wrapped(self.at(np.array([self.parameter(q)]))[0] - q)).max() < SAME)

    def _nearest(self, q: Array) -> float:
        """The parameter of the point between nodes nearest to q (nq,), without Newton's method."""
        if len(self.knots) == 1:
            return 0.0
        away = wrapped(q - self.nodes[:-1])
        chord = np.diff(self.nodes, axis=0)
        share = np.clip((away * chord).sum(axis=1) / (chord * chord).sum(axis=1), 0.0, 1.0)
        pieces = np.arange(len(chord))
        k = int(np.abs(wrapped(self._on_piece(pieces, share) - q)).max(axis=1).argmin())
        return self.clipped(float(self.knots[k] + share[k] * (self.knots[k + 1] - self.knots[k])))

    def clipped(self, parameter: float) -> float:
        """The nearest parameter on an arc."""
        found = []
        for lower, upper in self.arcs:
            middle = (lower + upper) / 2
            near = parameter + 2 * np.pi * round((middle - parameter) / (2 * np.pi)) if self.closed else parameter
            on_arc = float(np.clip(near, lower, upper))
            found.append((abs(near - on_arc), on_arc))
        return min(found)[1]

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """See `SelfMotion`; by the greatest rate of each joint between nodes.

        No bound rests on this alone: where curves may be missed, bounds cover all configurations.
        """
        centre = self.at(np.asarray(parameter, dtype=float))
        if len(self.knots) == 1:
            return centre, np.full_like(centre, ROUNDING)
        rates = np.abs(np.diff(self.nodes, axis=0) / np.diff(self.knots)[:, None]).max(axis=0)
        return centre, np.minimum(FASTER * np.asarray(half, dtype=float)[:, None] * rates + ROUNDING, np.pi)


def members(curves: Sequence[TracedCurve], parameters: Sequence[Array]) -> list[Array]:
    """The configurations (n, nq) [rad] of each of the curves of one pose at its parameters (n,)."""
    near = [curve.nearly(at) for curve, at in zip(curves, parameters, strict=True)]
    return np.split(curves[0].onto(np.vstack(near)), np.cumsum([len(each) for each in near])[:-1])
