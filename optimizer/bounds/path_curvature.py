"""Bounds on the change of a dual bound's terms between the points at which they are computed."""

from __future__ import annotations

from itertools import pairwise
from math import prod

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.grid_cells import Curvature

DIFFERENCE_STEP = 1e-5
"""Step of the difference quotient along the multipliers, relative to the multipliers."""


class PathCurvature:
    """Bounds on derivatives of the terms in each step of a path."""

    def __init__(
        self,
        chain: ChainDerivatives,
        dx: Array,
        omega: Array,
        grid: tuple[int, ...],
        others: tuple[int, ...],
    ) -> None:
        """The bounds of a chain.

        Args:
            chain: chain of the arm.
            dx: steps of the path, shape (S, nq) [rad].
            omega: ω at the nodes, shape (S + 1, nq) [rad/s], linear on each step.
            grid: joints of the grid.
            others: the other joints.
        """
        self.dx, self.grid, self.others = np.abs(dx), list(grid), list(others)
        self.change = np.abs(np.diff(omega, axis=0))
        self.most = np.array([np.maximum(np.abs(a), np.abs(b)) for a, b in pairwise(omega)])
        self.U2, self.U3, self.U4 = (chain.potential_bound(n) for n in (2, 3, 4))
        self.D1, self.D2, D3 = (chain.inertia_bound(n) for n in (1, 2, 3))
        # ∂²M and ∂³M by ω, (S, nq, nq, nq) and (S, nq, nq, nq, nq)
        self.D2_most, self.D3_most = _along(self.most, self.D2), _along(self.most, D3)
        D2_step, D3_step = _along(self.dx, self.D2), _along_each(self.dx, self.D3_most)
        self.M_along = _along_each(self.dx, D2_step) / 8
        # N, a derivative of M along ω, is a difference quotient; its error is a second derivative
        missed = DIFFERENCE_STEP / 2 * _along_each(self.most, self.D2_most)
        # second derivative of N over a step: ω changes, and so does ∂M
        self.N_along = (
            _along_each(self.dx, D3_step) + 2 * _along_each(self.change, D2_step)
        ) / 8 + missed

    def gravity(self) -> Curvature:
        """Curvature of ω · g [W]."""
        along = 2 * ((self.change @ self.U2) * self.dx).sum(axis=1)
        along += _along_each(self.dx, _along_each(self.dx, _along(self.most, self.U3)))
        across = [self.most @ self.U3[:, g, g] for g in self.grid]
        return Curvature(along / 8, np.stack(across, axis=1))

    def slope(self) -> Curvature:
        """Curvature of the gradient of ω · g, by all joints."""
        along = 2 * _along_each(self.dx, _along(self.change, self.U3))
        along += _along_each(self.dx, _along_each(self.dx, _along(self.most, self.U4)))
        across = [self.most @ self.U4[:, :, g, g] for g in self.grid]
        return Curvature(along / 8, np.stack(across, axis=1))

    def inertia(self, omega_rate: Array, x_rate: Array) -> tuple[Curvature, Curvature]:
        """Curvatures of `kinetic` and `momentum`, with the error of the difference quotient along
        the path.
        """
        M, N = (
            np.stack([each[g, g] for g in self.grid])
            for each in (self.D2, self.D3_most.transpose(1, 2, 0, 3, 4))
        )
        own, other = self.M_along @ omega_rate[..., None], self.N_along @ x_rate[..., None]
        own_across, other_across = M[:, None] @ omega_rate[..., None], N @ x_rate[..., None]
        momentum = Curvature(
            (own + other)[..., 0], (own_across + other_across)[..., 0].transpose(1, 0, 2)
        )
        kinetic = Curvature(
            ((own + other / 2)[..., 0] * x_rate).sum(axis=-1),
            ((own_across + other_across / 2)[..., 0] * x_rate).sum(axis=-1).T,
        )
        return kinetic, momentum

    def others_of(self, omega_rate: Array, x_rate: Array) -> tuple[Array, Array, Array]:
        """Bounds on derivatives by the joints beside the grid.

        Args:
            omega_rate: |ω'|, shape (S, nq).
            x_rate: |x'|, shape (S, nq).

        Returns:
            Row sums of the second derivatives of ω · g, and first derivatives of `kinetic` and
            `momentum`.
        """
        others = self.others
        gravity = _along(self.most, self.U3)[:, others][:, :, others].sum(axis=-1)
        own = (self.D1[others] @ omega_rate[:, None, :, None])[..., 0]
        other = (self.D2_most[:, others] @ x_rate[:, None, :, None])[..., 0]
        return gravity, ((own + other / 2) * x_rate[:, None]).sum(axis=-1), own + other

    def spread(self, rows: Array, spacing: Array, half: Array) -> Array:
        """Bounds ν (S, nq) with Σ_jk N_jk w_j w_k ≤ Σ_j ν_j w_j².

        The sum is at most Σ_j (max(N_jj, 0) + Σ_{k≠j} |N_jk|) w_j². This row sum is convex in N, so
        its greatest value at the corners of a cell bounds it for interpolated N. The error of the
        interpolation is added row by row.

        Args:
            rows: greatest row sums at the points of a node, shape (S + 1, nq).
            spacing: greatest spacing of the grid along both of its joints [rad].
            half: half sides of the boxes, shape (S, nq) [rad].
        """
        across = (
            sum(
                self.D3_most[:, g, g].sum(axis=-1) * h**2
                for g, h in zip(self.grid, spacing, strict=True)
            )
            / 8
        )
        beside = _along_each(half[:, self.others], self.D2_most[:, self.others]).sum(axis=-1)
        return np.asarray(
            np.maximum(rows[:-1], rows[1:]) + across + self.N_along.sum(axis=-1) + beside
        )


def _along(direction: Array, bound: Array) -> Array:
    """A bound (nq, ...) on derivatives by joints, along directions (S, nq): shape (S, ...)."""
    return np.asarray(
        (direction @ bound.reshape(len(bound), -1)).reshape(len(direction), *bound.shape[1:])
    )


def _along_each(direction: Array, bound: Array) -> Array:
    """Bounds (S, nq, ...) on derivatives, each along its own direction (S, nq): shape (S, ...)."""
    flat = bound.reshape(*bound.shape[:2], prod(bound.shape[2:]))
    return np.asarray((direction[:, None] @ flat).reshape(len(bound), *bound.shape[2:]))
