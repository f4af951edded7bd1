"""Terms of a dual bound at the points of a grid around the nodes of its path."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.path_curvature import DIFFERENCE_STEP
from joulepath.optimizer.native.shared_library import address, library


@dataclass(frozen=True)
class GridPoints:
    """Terms at both ends of each of S steps and K points, with N = Σ_i ω_i ∂_i M.

    Primes are derivatives by the share of the duration. Terms are 0 at points that are not needed.
    """

    gravity: Array
    """ω · g, shape (S, 2, K) [W]."""
    slope: Array
    """Gradient of ω · g, shape (S, 2, K, nq)."""
    kinetic: Array
    """ω' · M x' + x' · N x' / 2, shape (S, 2, K)."""
    momentum: Array
    """M ω' + N x', shape (S, 2, K, nq)."""
    rows: Array
    """Greatest max(N_jj, 0) + Σ_{k≠j} |N_jk| over the points of a node, shape (S + 1, nq)."""

    @classmethod
    def of(
        cls, chain: ChainDerivatives, x: Array, omega: Array, offsets: Array, needed: Mask
    ) -> GridPoints:
        """The terms around a path.

        Args:
            chain: chain of the arm.
            x: nodes of the path, shape (S + 1, nq) [rad].
            omega: ω at the nodes, shape (S + 1, nq) [rad/s].
            offsets: points relative to the path, shape (K, nq) [rad].
            needed: points that a motion may come near, shape (S + 1, K).
        """
        S, nq, K = len(x) - 1, chain.nq, len(offsets)
        scalar, by_joint = (S, 2, K), (S, 2, K, nq)
        points = cls(*map(np.zeros, (scalar, by_joint, scalar, by_joint, (S + 1, nq))))
        path = [np.ascontiguousarray(each) for each in (x, omega, offsets, needed)]
        result = points.gravity, points.slope, points.kinetic, points.momentum, points.rows
        library.grid_points(
            ctypes.addressof(chain.as_c[0]),
            S,
            K,
            DIFFERENCE_STEP,
            *map(address, (*path, *result)),
        )
        return points
