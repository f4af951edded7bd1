"""The terms of a dual bound's path at every point of the grid around its nodes."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.path_curvature import STEP
from joulepath.optimizer.native.shared_library import address, shared_library


@dataclass(frozen=True)
class GridPoints:
    """Terms at both ends of each step and K points, (S, 2, K, ...), of multipliers ω and path x, N = Σ_i ω_i ∂_i M.

    `gravity` is ω · g [W], `slope` (..., nq) its gradient, `kinetic` ω' · M x' + x' · N x' / 2, `momentum` (..., nq)
    M ω' + N x', 0 where no motion needs them; `rows` (S + 1, nq) are the greatest max(N_jj, 0) + Σ_{k≠j} |N_jk| of a
    node's points.
    """

    gravity: Array
    slope: Array
    kinetic: Array
    momentum: Array
    rows: Array

    @classmethod
    def of(cls, chain: ChainDerivatives, x: Array, omega: Array, offsets: Array, needed: Mask) -> GridPoints:
        """The terms around a path x (S + 1, nq) [rad] with multipliers (S + 1, nq) [rad/s], at `offsets` (K, nq)
        [rad], where `needed` (S + 1, K)."""
        library = shared_library()
        if library is None:
            return cls.by_numpy(chain, x, omega, offsets, needed)
        S, nq, K = len(x) - 1, chain.nq, len(offsets)
        scalar, by_joint = (S, 2, K), (S, 2, K, nq)
        points = cls(*map(np.zeros, (scalar, by_joint, scalar, by_joint, (S + 1, nq))))
        path = [np.ascontiguousarray(each) for each in (x, omega, offsets, needed)]
        result = points.gravity, points.slope, points.kinetic, points.momentum, points.rows
        library.grid_points(ctypes.addressof(chain.as_c[0]), S, K, STEP, *map(address, (*path, *result)))
        return points

    @classmethod
    def by_numpy(cls, chain: ChainDerivatives, x: Array, omega: Array, offsets: Array, needed: Mask) -> GridPoints:
        """The same where the shared library cannot be compiled."""
        S, K = len(x) - 1, len(offsets)
        x_rate, omega_rate = np.diff(x, axis=0) * S, np.diff(omega, axis=0) * S
        q, flat = (x[:, None] + offsets)[needed], needed.ravel()

        def placed(values: Array) -> Array:
            every = np.zeros((flat.size, *values.shape[1:]))
            every[flat] = values
            return every.reshape(S + 1, K, *values.shape[1:])

        torque, slope = map(placed, chain.gravity_torque(q))
        own = chain.joint_inertia(q)
        beside = chain.joint_inertia(q + STEP * np.repeat(omega, K, axis=0)[flat])
        M, N = placed(own), placed((beside - own) / STEP)
        momentum = _sides(
            lambda at: np.einsum("spjk,sk->spj", M[at], omega_rate) + np.einsum("spjk,sk->spj", N[at], x_rate)
        )
        kinetic = _sides(
            lambda at: (
                np.einsum("sj,spjk,sk->sp", omega_rate, M[at], x_rate)
                + np.einsum("sj,spjk,sk->sp", x_rate, N[at], x_rate) / 2
            )
        )
        diagonal = np.einsum("npjj->npj", N)
        return cls(
            _sides(lambda at: np.einsum("sj,spj->sp", omega[at], torque[at])),
            _sides(lambda at: np.einsum("sj,spjk->spk", omega[at], slope[at])),
            kinetic,
            momentum,
            (np.abs(N).sum(axis=-1) - np.abs(diagonal) + np.maximum(diagonal, 0.0)).max(axis=1),
        )


def _sides(term: Callable[[slice], Array]) -> Array:
    """A term of the nodes at both ends of each step, (S, 2, ...)."""
    return np.stack([term(slice(None, -1)), term(slice(1, None))], axis=1)
