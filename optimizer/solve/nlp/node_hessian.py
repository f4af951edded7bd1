"""Hessian of an NLP's Lagrangian, from derivatives at the nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.active_path_constraints import Index


@dataclass(frozen=True)
class Overlaps:
    """Pairs i ≤ j of free control points that move a common node; a control point moves few."""

    i: Index
    """First control points, shape (pairs,)."""

    j: Index
    """Second control points, shape (pairs,)."""

    products: Array
    """Products D_kdi · D_kej of basis functions and derivatives, in order of k, d, e, shape
    (pairs, 9 N)."""

    @classmethod
    def of(cls, D: Array) -> Overlaps:
        """Pairs of the basis functions and derivatives D (N, 3, m) at the nodes."""
        reached = np.abs(D).max(axis=1) > 0
        i, j = np.nonzero(np.triu(reached.T @ reached))
        products = D[:, :, None, i] * D[:, None, :, j]
        return cls(i, j, np.ascontiguousarray(products.reshape(-1, len(i)).T))

    def sum(self, H: Array, m: int) -> Array:
        """Σ_k D_kᵀ H_k D_k as (m r, m r), for symmetric H (N, 3, r, 3, r)."""
        r = H.shape[2]
        blocks = (self.products @ H.transpose(0, 1, 3, 2, 4).reshape(-1, r * r)).reshape(-1, r, r)
        total = np.zeros((m, r, m, r))
        total[self.i, :, self.j] = blocks
        total[self.j, :, self.i] = blocks.transpose(0, 2, 1)
        return total.reshape(m * r, m * r)


@dataclass(frozen=True)
class NodeStates:
    """States z = (s, v, a) at the nodes, with derivatives of the states and of the Lagrangian."""

    T: float
    """Duration [s]."""

    z: Array
    """States, shape (N, 3, r)."""

    D: Array
    """∂z/∂s, shape (N, 3, m)."""

    rate: Array
    """∂z/∂T, shape (N, 3, r)."""

    lagrangian: Array
    """Gradient of the Lagrangian by z, shape (N, 3, r)."""

    H: Array
    """Hessian of the Lagrangian by z, shape (N, 3, r, 3, r)."""

    scale: Array
    """Powers of T in D, shape (3,)."""

    def hessian(self, overlaps: Overlaps, gradient_s: Array, slope: float) -> Array:
        """Hessian of the Lagrangian by (s, T).

        Args:
            overlaps: pairs of control points with a common node.
            gradient_s: gradient of the cost by s, shape (m, r).
            slope: Σ_k w_k ∂ℓ_k/∂T.

        Returns:
            The Hessian, shape (m r + 1, m r + 1).
        """
        T, rate = self.T, self.rate
        (count, _, m), r = self.D.shape, self.z.shape[2]
        flat = self.D.reshape(count * 3, m)
        H_ss = overlaps.sum(self.H * np.outer(self.scale, self.scale)[:, None, :, None], m)
        H_rate = (self.H.reshape(count, 3 * r, 3 * r) @ rate.reshape(count, 3 * r, 1)).reshape(
            count, 3, r
        )
        D_rate = self.D * np.array([0.0, -1.0 / T, -2.0 / T])[:, None]
        H_sT = (
            flat.T @ H_rate.reshape(count * 3, r)
            + D_rate.reshape(count * 3, m).T @ self.lagrangian.reshape(count * 3, r)
            + gradient_s / T
        )
        curvature = self.z * np.array([0.0, 2.0 / (T * T), 6.0 / (T * T)])[:, None]
        H_TT = 2 * slope + (rate * H_rate).sum() + (self.lagrangian * curvature).sum()
        hessian = np.empty((m * r + 1, m * r + 1))
        hessian[:-1, :-1] = H_ss
        hessian[:-1, -1] = hessian[-1, :-1] = H_sT.ravel()
        hessian[-1, -1] = H_TT
        return hessian
