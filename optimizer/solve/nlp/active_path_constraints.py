"""Path constraints (tool cone, TCP and elbow speed, clearance) as rows of an NLP.

Each constraint is a ratio value / limit of the joint positions q and speeds v. The NLP bounds every
ratio at the path points of its basis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.models.rows import Rows
from joulepath.optimizer.kinematics.path_constraints import ConstraintRatios, PathConstraints
from joulepath.optimizer.solve.nlp.coordinates import Coordinates

Index = npt.NDArray[np.intp]
# step of q [rad] and v [rad/s] in finite differences of gradients
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class PathConstraintValues:
    """States and ratios at the M path points."""

    q: Array
    """Joint positions, shape (M, nq) [rad]."""

    v: Array
    """Joint speeds, shape (M, nq) [rad/s]."""

    ratios: ConstraintRatios
    """Ratios (M, c) with gradients by q and v."""


@dataclass(frozen=True)
class NearPathConstraints(Rows):
    """Path constraints near their bounds."""

    points: Index
    """Path points, shape (rows,)."""

    columns: Index
    """Columns of the constraints, shape (rows,)."""

    ratio: Array
    """Ratios, shape (rows,)."""

    slack: Array
    """Distances to the bounds, shape (rows,)."""


_NONE_NEAR = NearPathConstraints(
    *(np.zeros(0, dtype=kind) for kind in (np.intp, np.intp, float, float))
)


@dataclass(frozen=True)
class PathConstraintRows:
    """Path constraints as functions of free control points s (m, r) and duration T."""

    constraints: PathConstraints | None
    """The constraints; None without constraints."""

    bounds: Array
    """Bounds of the ratios, shape (c,)."""

    coordinates: Coordinates
    """Coordinates of the spline."""

    at_path: Array
    """Basis functions and first derivatives at the path points, shape (2, M, n)."""

    at_path_free: Array
    """The same for the free control points, shape (2, M, m)."""

    @property
    def nq(self) -> int:
        """Number of joints."""
        return len(self.coordinates.origin)

    @property
    def n(self) -> int:
        """Number of decision variables: the free control points row by row, then T."""
        return int(self.at_path_free.shape[2]) * self.coordinates.r + 1

    def values(self, points: Array, T: float) -> PathConstraintValues:
        """Values for all control points (n, r); empty arrays without constraints."""
        if self.constraints is None:
            none = np.zeros((0, self.nq))
            return PathConstraintValues(
                none, none, ConstraintRatios(none[:, :0], none[:, None], none[:, None])
            )
        s, rising = self.at_path @ points
        q, v = self.coordinates.to_joints(s), rising @ self.coordinates.directions.T / T
        return PathConstraintValues(q, v, self.constraints.linearised(q, v))

    def near(self, values: PathConstraintValues, near: float) -> NearPathConstraints:
        """Constraints with a ratio above `near` times the bound."""
        if self.constraints is None:
            return _NONE_NEAR
        ratio = values.ratios.value
        k, c = np.unravel_index(np.flatnonzero(ratio > near * self.bounds), ratio.shape)
        found = ratio[k, c]
        return NearPathConstraints(k, c, found, self.bounds[c] - found)

    def gradients(self, values: PathConstraintValues, T: float, of: NearPathConstraints) -> Array:
        """Gradients (rows, n) of constraints by (s, T)."""
        k, c = of.points, of.columns
        at, rising = self.at_path_free[:, k, :, None]
        P, result = self.coordinates.directions, np.zeros((len(k), self.n))
        by_points = at * (values.ratios.by_q[k, c] @ P)[:, None]
        if self.constraints is not None and self.constraints.limit_speeds:
            by_v = values.ratios.by_v[k, c]
            by_points += rising * (by_v @ P / T)[:, None]
            result[:, -1] = -np.einsum("rj,rj->r", by_v, values.v[k]) / T
        result[:, :-1] = by_points.reshape(len(k), self.n - 1)
        return result

    def changes(
        self, values: PathConstraintValues, T: float, of: NearPathConstraints, ds: Array, dT: float
    ) -> Array:
        """Changes (rows,) of ratios to first order, for a step ds (m, r) and dT [s]."""
        k, c = of.points, of.columns
        dq, rising = self.at_path_free @ ds @ self.coordinates.directions.T
        change = np.einsum("rj,rj->r", values.ratios.by_q[k, c], dq[k])
        if self.constraints is not None and self.constraints.limit_speeds:
            dv = (rising - values.v * dT) / T
            change += np.einsum("rj,rj->r", values.ratios.by_v[k, c], dv[k])
        return np.asarray(change)

    def hessian(self, values: PathConstraintValues, T: float, weights: Array) -> Array:
        """Hessian (n, n) of Σ weights · ratios, weights (M, c), by differences of gradients."""
        k = np.flatnonzero(weights.any(axis=1))
        if self.constraints is None or not len(k):
            return np.zeros((self.n, self.n))
        nq, v, w = self.nq, values.v[k], weights[k]
        y = np.hstack([values.q[k], v])
        # constraints on positions alone need no steps in speed
        steps = DIFFERENCE * np.eye(2 * nq if self.constraints.limit_speeds else nq, 2 * nq)
        stepped = np.concatenate([y[None], y + steps[:, None]]).reshape(-1, 2 * nq)
        ratios = self.constraints.linearised(
            stepped[:, :nq], stepped[:, nq:], np.tile(w != 0, (len(steps) + 1, 1))
        )
        # of hundreds of pairs of bodies, few have a weight
        c = np.flatnonzero(w.any(axis=0))
        by_state = (
            each[:, c].reshape(len(steps) + 1, len(k), len(c), nq)
            for each in (ratios.by_q, ratios.by_v)
        )
        slopes = np.concatenate(
            [np.einsum("kc,skcj->skj", w[:, c], each) for each in by_state], axis=2
        )
        bent = np.zeros((len(k), 2 * nq, 2 * nq))
        bent[:, : len(steps)] = (slopes[1:] - slopes[0]).transpose(1, 0, 2) / DIFFERENCE
        # a factorisation reads half of the Hessian, whose differences are not quite symmetric
        bent = (bent + bent.transpose(0, 2, 1)) / 2
        Y = np.concatenate(self._state_gradients(v, T, k), axis=1)
        hessian: Array = Y.reshape(-1, self.n).T @ (bent @ Y).reshape(-1, self.n)
        # second derivatives of v = s' / T by (s, T)
        by_v, V = slopes[0][:, nq:], Y[:, nq:]
        mixed = -np.einsum("kj,kjn->n", by_v, V)[:-1] / T
        hessian[:-1, -1] += mixed
        hessian[-1, :-1] += mixed
        hessian[-1, -1] += 2 * float((by_v * v).sum()) / (T * T)
        return hessian

    def _state_gradients(self, v: Array, T: float, k: Index) -> tuple[Array, Array]:
        """Gradients of q and v (rows, nq, n) at path points k, with joint speeds v (rows, nq)."""
        at, rising = self.at_path_free[:, k]
        P, shape = self.coordinates.directions, (len(k), self.nq, self.n - 1)
        Q = np.einsum("km,jr->kjmr", at, P).reshape(shape)
        V = np.einsum("km,jr->kjmr", rising / T, P).reshape(shape)
        none = np.zeros((len(k), self.nq, 1))
        return np.concatenate([Q, none], axis=2), np.concatenate([V, -v[..., None] / T], axis=2)
