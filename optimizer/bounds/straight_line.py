"""Gravity torques along straight lines, from samples, with bounds on the error of the samples.

The symbols are those of the proof in `holding`. The trapezoidal mean errs by at most 1 / 12 of the
second derivative over a step. Γ errs at the nodes by 1 / 12 of the second derivative of A; between
the nodes, where it is taken as linear, by 1 / 8 of the first derivative of A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.subdivide import Rows

STEPS = 16
"""Number of steps of a line between its samples."""


@dataclass(frozen=True)
class Line(Rows):
    """Gravity along straight lines of displacements d, for ω_i = 1 and by the share of the
    duration.
    """

    d: Array
    """Displacements, shape (P, nq) [rad]."""
    gravity: Array
    """Means of the gravity torques g, shape (P, nq) [N·m]."""
    gravity_error: Array
    """Bounds on their errors, shape (P, nq) [N·m]."""
    product: Array
    """∫ (Γ - mean) of joint i times that of joint j, for each l, shape (P, nq, nq, nq)."""
    error: Array
    """Bounds on the errors of Γ by joints i and l, shape (P, nq, nq) [N·m]."""
    odd: Array
    """Mean size of the odd part of A by joints i and l, shape (P, nq, nq) [N·m]."""
    gradient: Array
    """Gradient of the mean of g by the goal, shape (P, nq, nq) [N·m]."""
    gradient_error: Array
    """Bounds on its errors, shape (P, nq, nq) [N·m]."""

    @classmethod
    def of(cls, chain: ChainDerivatives, start: Array, d: Array) -> Line:
        """Lines of displacements d (P, nq) [rad] from starts (P, nq) [rad]."""
        share = np.linspace(0.0, 1.0, STEPS + 1)
        q = start[:, None] + share[:, None] * d[:, None]
        torque, slope = chain.gravity_torque(q.reshape(-1, chain.nq))
        torque, slope = (each.reshape(*q.shape[:2], *each.shape[1:]) for each in (torque, slope))
        weight = np.full(STEPS + 1, 1 / STEPS)
        weight[[0, -1]] /= 2
        steps = (slope[:, 1:] + slope[:, :-1]) / (2 * STEPS)
        total = np.concatenate([np.zeros_like(slope[:, :1]), np.cumsum(steps, axis=1)], axis=1)
        total -= np.einsum("n,pnil->pil", weight, total)[:, None]
        first, last = total[:, :-1], total[:, 1:]
        pairs = "pnil,pnjl->pijl"
        cross = np.einsum(pairs, first, last)
        product = np.einsum(pairs, first, first) + np.einsum(pairs, last, last)
        product = (product + (cross + cross.transpose(0, 2, 1, 3)) / 2) / (3 * STEPS)
        away = np.abs(d)
        second, third = chain.potential_bound(3), chain.potential_bound(4)
        along = np.einsum("ilm,pm->pil", second, away)
        twice = np.einsum("ilmn,pm,pn->pil", third, away, away)
        odd = np.einsum("n,pnil->pil", weight, np.abs(slope - slope[:, ::-1]) / 2)
        return cls(
            d,
            np.einsum("n,pni->pi", weight, torque),
            np.einsum("pil,pl->pi", along, away) / (12 * STEPS**2),
            product,
            along / (8 * STEPS**2) + twice / (12 * STEPS**2),
            odd + twice / (8 * STEPS**2),
            np.einsum("n,pnil->pil", weight * share, slope),
            (twice + 2 * along) / (12 * STEPS**2),
        )
