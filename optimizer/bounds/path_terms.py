"""Gravity and inertia terms of a dual bound on a grid around its path, with bounds on what lies between grid points.

A value at a point of a cell (a step of the path, and an interval of each grid joint) is at least the least value at
the cell's corners, less Σ h² / 8 · (bound on the second derivative along the side h) over the cell's sides:
interpolation along one side errs by no more than that, and does not increase the others' second derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.robot import Array
from optimizer.bounds.chain_derivatives import ChainDerivatives
from optimizer.bounds.reference import Reference

# spacing of the grid around the path [rad], and its growth from one interval to the next outwards
_SPACING, _GROWTH = 0.16, 1.25
# step of the central difference along the multipliers, relative to them
_STEP = 1e-4


@dataclass(frozen=True)
class Curvature:
    """Bounds on a term's change that its corners do not show: `along` (S, ...) is 1/8 of the second derivative over a
    step, `across` (S, grid joints, ...) the second derivatives by the grid joints [1/rad²]."""

    along: Array
    across: Array


@dataclass(frozen=True)
class PathTerms:
    """Terms of a path and its multipliers ω = 2 c λ at both ends of each step and every grid point, (S, 2, K, ...).

    With x' and ω' for the derivatives by the share of the duration, N = Σ_i ω_i ∂_i M: `gravity` = ω · g [W],
    `torque_slope` = its gradient, `kinetic` = ω' · M x' + x' · N x' / 2, `momentum` = M ω' + N x'. `spread` (S, nq)
    bounds how far w · N w exceeds zero by w², for every joint and anywhere in the boxes. `others` are the joints beside
    the grid's; by them, `gravity` has second derivatives whose rows add up to at most `gravity_others` (S, others), and
    `kinetic_others` (S, others) and `momentum_others` (S, others, nq) bound the first derivatives.
    """

    offsets: Array
    axes: tuple[Array, ...]
    grid: tuple[int, ...]
    others: tuple[int, ...]
    half: Array
    omega: Array
    x_rate: Array
    gravity: Array
    torque_slope: Array
    kinetic: Array
    momentum: Array
    gravity_curvature: Curvature
    slope_curvature: Curvature
    kinetic_curvature: Curvature
    momentum_curvature: Curvature
    gravity_others: Array
    kinetic_others: Array
    momentum_others: Array
    spread: Array

    @property
    def centre(self) -> int:
        """Index of the grid point on the path."""
        return int(np.flatnonzero((self.offsets == 0).all(axis=1))[0])


def axis(half: float) -> Array:
    """Grid positions [rad] from -half to half, with 0 among them, closer near 0."""
    nodes, spacing = [0.0], _SPACING
    while nodes[-1] < half:
        nodes.append(nodes[-1] + spacing)
        spacing *= _GROWTH
    positive = np.array(nodes) * (half / nodes[-1])
    return np.concatenate([-positive[:0:-1], positive])


def path_terms(
    chain: ChainDerivatives, reference: Reference, loss: Array, half: Array, grid: tuple[int, ...]
) -> PathTerms:
    """The terms for copper loss `loss` (nq,) [W/(N·m)²], boxes of half sides `half` (S, nq) and the joints `grid`."""
    x, S, nq = reference.x, reference.steps, chain.nq
    omega = 2 * loss * reference.multipliers
    x_rate, omega_rate = np.diff(x, axis=0) * S, np.diff(omega, axis=0) * S
    axes = tuple(axis(float(half[:, j].max())) for j in grid)
    offsets = np.zeros((int(np.prod([len(a) for a in axes])), nq))
    offsets[:, grid] = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(len(offsets), -1)
    q = (x[:, None] + offsets).reshape(-1, nq)
    shape = (S + 1, len(offsets))
    torque, slope = (each.reshape(*shape, *each.shape[1:]) for each in chain.gravity_torque(q))
    M = chain.joint_inertia(q).reshape(*shape, nq, nq)
    step = np.repeat(_STEP * omega, len(offsets), axis=0)
    N = ((chain.joint_inertia(q + step) - chain.joint_inertia(q - step)) / (2 * _STEP)).reshape(M.shape)
    momentum = _sides(
        lambda at: np.einsum("spjk,sk->spj", M[at], omega_rate) + np.einsum("spjk,sk->spj", N[at], x_rate)
    )
    kinetic = _sides(
        lambda at: (
            np.einsum("sj,spjk,sk->sp", omega_rate, M[at], x_rate)
            + np.einsum("sj,spjk,sk->sp", x_rate, N[at], x_rate) / 2
        )
    )
    others = tuple(j for j in range(nq) if j not in grid)
    bounds = _Bounds(chain, np.abs(np.diff(x, axis=0)), omega, grid, others)
    return PathTerms(
        offsets, axes, grid, others, half, omega, x_rate,
        _sides(lambda at: np.einsum("sj,spj->sp", omega[at], torque[at])),
        _sides(lambda at: np.einsum("sj,spjk->spk", omega[at], slope[at])),
        kinetic, momentum,
        bounds.gravity(), bounds.slope(), *bounds.inertia(np.abs(omega_rate), np.abs(x_rate)),
        *bounds.others_of(np.abs(omega_rate), np.abs(x_rate)),
        bounds.spread(N, np.array([np.diff(a).max() for a in axes]), half),
    )  # fmt: skip


def _sides(term: Callable[[slice], Array]) -> Array:
    """A term of the nodes at both ends of each step, (S, 2, ...)."""
    return np.stack([term(slice(None, -1)), term(slice(1, None))], axis=1)


class _Bounds:
    """Bounds on derivatives of the terms, in each step of a path."""

    def __init__(
        self, chain: ChainDerivatives, dx: Array, omega: Array, grid: tuple[int, ...], others: tuple[int, ...]
    ) -> None:
        self.dx, self.grid, self.others = dx, list(grid), list(others)
        self.change = np.abs(np.diff(omega, axis=0))
        self.most = np.array([np.maximum(np.abs(a), np.abs(b)) for a, b in pairwise(omega)])
        self.U2, self.U3, self.U4 = (chain.potential_bound(n) for n in (2, 3, 4))
        self.D1, self.D2, self.D3 = (chain.inertia_bound(n) for n in (1, 2, 3))
        # N, a derivative of M along ω, is a central difference; what it misses is a third derivative
        self.missed = _STEP**2 / 6 * np.einsum("si,sl,sn,ilnjk->sjk", self.most, self.most, self.most, self.D3)
        D2 = np.einsum("lnjk,sl,sn->sjk", self.D2, dx, dx)
        self.M_along = D2 / 8
        # second derivative of N over a step: ω changes, and so does ∂M
        self.N_along = (
            np.einsum("si,ilnjk,sl,sn->sjk", self.most, self.D3, dx, dx)
            + 2 * np.einsum("si,iljk,sl->sjk", self.change, self.D2, dx)
        ) / 8 + self.missed  # fmt: skip

    def gravity(self) -> Curvature:
        along = 2 * np.einsum("sj,jk,sk->s", self.change, self.U2, self.dx)
        along += np.einsum("sj,jkl,sk,sl->s", self.most, self.U3, self.dx, self.dx)
        across = [self.most @ self.U3[:, g, g] for g in self.grid]
        return Curvature(along / 8, np.stack(across, axis=1))

    def slope(self) -> Curvature:
        along = 2 * np.einsum("sj,jlk,sk->sl", self.change, self.U3, self.dx)
        along += np.einsum("sj,jlkm,sk,sm->sl", self.most, self.U4, self.dx, self.dx)
        across = [self.most @ self.U4[:, :, g, g] for g in self.grid]
        return Curvature(along / 8, np.stack(across, axis=1))

    def inertia(self, omega_rate: Array, x_rate: Array) -> tuple[Curvature, Curvature]:
        """Curvatures of `kinetic` and `momentum`; the difference quotient's error is in the one along the path."""
        M = np.stack([self.D2[g, g] for g in self.grid])
        N = np.einsum("si,mijk->smjk", self.most, np.stack([self.D3[:, g, g] for g in self.grid]))
        momentum = Curvature(
            np.einsum("sjk,sk->sj", self.M_along, omega_rate) + np.einsum("sjk,sk->sj", self.N_along, x_rate),
            np.einsum("mjk,sk->smj", M, omega_rate) + np.einsum("smjk,sk->smj", N, x_rate),
        )
        kinetic = Curvature(
            np.einsum("sj,sjk,sk->s", omega_rate, self.M_along, x_rate)
            + np.einsum("sj,sjk,sk->s", x_rate, self.N_along, x_rate) / 2,
            np.einsum("sj,mjk,sk->sm", omega_rate, M, x_rate) + np.einsum("sj,smjk,sk->sm", x_rate, N, x_rate) / 2,
        )
        return kinetic, momentum

    def others_of(self, omega_rate: Array, x_rate: Array) -> tuple[Array, Array, Array]:
        """The bounds on derivatives by the joints beside the grid's."""
        others = self.others
        gravity = np.einsum("sj,jlm->sl", self.most, self.U3[np.ix_(range(len(self.U2)), others, others)])
        M, N = self.D1[others], np.einsum("si,iljk->sljk", self.most, self.D2[:, others])
        momentum = np.einsum("ljk,sk->slj", M, omega_rate) + np.einsum("sljk,sk->slj", N, x_rate)
        kinetic = np.einsum("sj,ljk,sk->sl", omega_rate, M, x_rate)
        return gravity, kinetic + np.einsum("sj,sljk,sk->sl", x_rate, N, x_rate) / 2, momentum

    def spread(self, N: Array, spacing: Array, half: Array) -> Array:
        """Σ_jk N_jk w_j w_k ≤ Σ_j (max(N_jj, 0) + Σ_{k≠j} |N_jk|) w_j²; this sum is convex in N, so that its greatest
        value at the corners bounds it for what interpolation gives, and the rest is added row by row."""
        own = np.einsum("npjj->npj", N)
        rows = (np.abs(N).sum(axis=-1) - np.abs(own) + np.maximum(own, 0.0)).max(axis=1)
        across = np.einsum("si,mijk,m->sj", self.most, np.stack([self.D3[:, g, g] for g in self.grid]), spacing**2) / 8
        beside = np.einsum("si,iljk,sl->sj", self.most, self.D2[:, self.others], half[:, self.others])
        return np.asarray(np.maximum(rows[:-1], rows[1:]) + across + self.N_along.sum(axis=-1) + beside)
