"""Torques of a chain at many postures, as coefficients of accelerations and products of speeds.

The torques of the bodies are τ_i = Σ_j M_ij a_j + Σ_jk N_ijk v_j v_k + g_i with the Christoffel
symbols N_ijk = (∂_k M_ij + ∂_j M_ik - ∂_i M_jk) / 2. M is a trigonometric polynomial of degree 2 in
every joint (`inertia_spectrum`). Riesz' interpolation formula gives its derivatives from four
values, without an error: p'(x) = Σ_r (-1)^(r+1) p(x + t_r) / (8 sin²(t_r / 2)) with
t_r = (2 r - 1) π / 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives

_SHIFTS = np.pi / 4 * np.array([1.0, 3.0, 5.0, 7.0])
_WEIGHTS = np.array([1.0, -1.0, 1.0, -1.0]) / (8 * np.sin(_SHIFTS / 2) ** 2)


@dataclass(frozen=True)
class PostureTerms:
    """Torques of the bodies of a chain, without rotors, at n postures.

    Attributes:
        inertia: M, shape (n, nq, nq) [kg·m²].
        velocity: N, shape (n, nq, nq, nq) [kg·m²].
        gravity: g, shape (n, nq) [N·m].
    """

    inertia: Array
    velocity: Array
    gravity: Array

    @classmethod
    def of(cls, chain: ChainDerivatives, q: Array) -> PostureTerms:
        """The terms at postures q, shape (n, nq) [rad]."""
        n, nq = q.shape
        # M does not depend on the first joint, which turns the whole arm
        slope = np.zeros((n, nq, nq, nq))
        for k in range(1, nq):
            for shift, weight in zip(_SHIFTS, _WEIGHTS, strict=True):
                shifted = q.copy()
                shifted[:, k] += shift
                slope[..., k] += weight * chain.joint_inertia(shifted)
        velocity = (slope + slope.swapaxes(2, 3) - slope.transpose(0, 3, 1, 2)) / 2
        inertia = chain.joint_inertia(q) - np.diag(chain.rotor)
        return cls(inertia, velocity, chain.gravity_torque(q)[0])
