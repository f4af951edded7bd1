"""Gravity torques along straight lines, by samples, with what these may miss: for `holding`, whose
names are used here.

The trapezoid's mean errs by 1 / 12 of the second derivative over a step, Γ at the nodes by as much
of that of A, and between them, where it is taken as linear, by 1 / 8 of the first of A.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives

# steps of a line
NODES = 16


@dataclass(frozen=True)
class Line:
    """Gravity along straight lines of displacements d (P, nq) [rad]: the means of g (P, nq) [N·m]
    and their errors.

    By joints i and l (P, nq, nq) [N·m]: `error` of Γ, mean size `odd` of the odd part of A,
    `gradient` of the mean of g by the goal and its error. `product` (P, nq, nq, nq) has ∫ (Γ -
    mean) of i times that of j, for l. All are for ω_i = 1, by the share of the duration.
    """

    d: Array
    gravity: Array
    gravity_error: Array
    product: Array
    error: Array
    odd: Array
    gradient: Array
    gradient_error: Array

    def __getitem__(self, chosen: slice | NDArray[np.intp]) -> Line:
        return Line(*(getattr(self, each.name)[chosen] for each in fields(self)))

    @classmethod
    def of(cls, chain: ChainDerivatives, start: Array, d: Array) -> Line:
        """The lines from starts (P, nq) [rad]."""
        share = np.linspace(0.0, 1.0, NODES + 1)
        q = start[:, None] + share[:, None] * d[:, None]
        torque, slope = chain.gravity_torque(q.reshape(-1, chain.nq))
        torque, slope = (each.reshape(*q.shape[:2], *each.shape[1:]) for each in (torque, slope))
        weight = np.full(NODES + 1, 1 / NODES)
        weight[[0, -1]] /= 2
        steps = (slope[:, 1:] + slope[:, :-1]) / (2 * NODES)
        total = np.concatenate([np.zeros_like(slope[:, :1]), np.cumsum(steps, axis=1)], axis=1)
        total -= np.einsum("n,pnil->pil", weight, total)[:, None]
        first, last = total[:, :-1], total[:, 1:]
        pairs = "pnil,pnjl->pijl"
        cross = np.einsum(pairs, first, last)
        product = np.einsum(pairs, first, first) + np.einsum(pairs, last, last)
        product = (product + (cross + cross.transpose(0, 2, 1, 3)) / 2) / (3 * NODES)
        away = np.abs(d)
        second, third = chain.potential_bound(3), chain.potential_bound(4)
        along = np.einsum("ilm,pm->pil", second, away)
        twice = np.einsum("ilmn,pm,pn->pil", third, away, away)
        odd = np.einsum("n,pnil->pil", weight, np.abs(slope - slope[:, ::-1]) / 2)
        return cls(
            d,
            np.einsum("n,pni->pi", weight, torque),
            np.einsum("pil,pl->pi", along, away) / (12 * NODES**2),
            product,
            along / (8 * NODES**2) + twice / (12 * NODES**2),
            odd + twice / (8 * NODES**2),
            np.einsum("n,pnil->pil", weight * share, slope),
            (twice + 2 * along) / (12 * NODES**2),
        )
