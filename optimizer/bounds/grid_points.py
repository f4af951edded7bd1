"""The terms of a dual bound's path at every point of the grid around its nodes."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.path_curvature import STEP
from joulepath.optimizer.native.shared_library import address, library


@dataclass(frozen=True)
class GridPoints:
    """Terms at both ends of each step and K points, (S, 2, K, ...), of multipliers ω and path x, N
    = Σ_i ω_i ∂_i M.

    `gravity` is ω · g [W], `slope` (..., nq) its gradient, `kinetic` ω' · M x' + x' · N x' / 2,
    `momentum` (..., nq) M ω' + N x', 0 where no motion needs them; `rows` (S + 1, nq) are the
    greatest max(N_jj, 0) + Σ_{k≠j} |N_jk| of a node's points.
    """

    gravity: Array
    slope: Array
    kinetic: Array
    momentum: Array
    rows: Array

    @classmethod
    def of(
        cls, chain: ChainDerivatives, x: Array, omega: Array, offsets: Array, needed: Mask
    ) -> GridPoints:
        """The terms around a path x (S + 1, nq) [rad] with multipliers (S + 1, nq) [rad/s], at
        `offsets` (K, nq) [rad], where `needed` (S + 1, K)."""
        S, nq, K = len(x) - 1, chain.nq, len(offsets)
        scalar, by_joint = (S, 2, K), (S, 2, K, nq)
        points = cls(*map(np.zeros, (scalar, by_joint, scalar, by_joint, (S + 1, nq))))
        path = [np.ascontiguousarray(each) for each in (x, omega, offsets, needed)]
        result = points.gravity, points.slope, points.kinetic, points.momentum, points.rows
        library.grid_points(
            ctypes.addressof(chain.as_c[0]), S, K, STEP, *map(address, (*path, *result))
        )
        return points
