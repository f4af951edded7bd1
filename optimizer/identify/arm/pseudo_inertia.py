"""Pseudo-inertias: the ten parameters of a body as a symmetric matrix (4, 4).

The matrix is [[Σ, h], [hᵀ, m]] with the second moments of mass Σ = tr(I)/2·1 - I and the first
moments h. It is positive semidefinite exactly for physically consistent bodies (Wensing, Kim,
Slotine 2018).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY


@dataclass(frozen=True)
class ConsistencySettings:
    """Smallest body that stands in for an inconsistent one."""

    min_gyration: float = 0.01
    """Radius of gyration added to a body, so that its pseudo-inertia has an inverse [m]."""
    min_mass: float = 1e-6
    """Smallest mass [kg]."""


CONSISTENCY = ConsistencySettings()


def _basis() -> Array:
    """Pseudo-inertias (10, 4, 4) of unit parameters m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz."""
    units = np.zeros((PARAMETERS_PER_BODY, 4, 4))
    units[0, 3, 3] = 1.0
    for axis in range(3):
        units[1 + axis, axis, 3] = units[1 + axis, 3, axis] = 1.0
    for k, (row, column) in enumerate(((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)), start=4):
        inertia = np.zeros((3, 3))
        inertia[row, column] = inertia[column, row] = 1.0
        units[k, :3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia
    return units


BASIS = _basis()


def pseudo_inertias(parameters: Array) -> Array:
    """Pseudo-inertias (bodies, 4, 4) of bodies with parameters (10 bodies,)."""
    return np.asarray(np.einsum("bk,kij->bij", parameters.reshape(-1, PARAMETERS_PER_BODY), BASIS))


def distance_metric(parameters: Array) -> Array:
    """Matrix M (10 bodies, 10 bodies) of the squared distance xᵀ M x from given bodies.

    The distance does not depend on units or frames; a change by the factor 1 + ε has the squared
    distance 2 ε² per body (Lee, Wensing, Park 2020: the pullback of the affine-invariant metric).
    The published parameters of some arms are physically inconsistent: the distance is then
    measured from the nearest consistent bodies.

    Args:
        parameters: parameters (10 bodies,) of the bodies.
    """
    matrices = pseudo_inertias(parameters)
    total = np.zeros((len(parameters),) * 2)
    for body, matrix in enumerate(matrices):
        inverse = np.linalg.inv(_nearest_consistent(matrix))
        turned = np.einsum("ij,kjl->kil", inverse, BASIS)
        at = slice(PARAMETERS_PER_BODY * body, PARAMETERS_PER_BODY * (body + 1))
        total[at, at] = np.einsum("kij,lji->kl", turned, turned) / 2
    return total


def _nearest_consistent(matrix: Array) -> Array:
    """The nearest pseudo-inertia (4, 4) of a consistent body with positive extent."""
    mass, moment = max(float(matrix[3, 3]), CONSISTENCY.min_mass), matrix[:3, 3]
    # second moments about the centre of mass, none of them below 0
    sizes, axes = np.linalg.eigh(matrix[:3, :3] - np.outer(moment, moment) / mass)
    extent = np.maximum(sizes, 0.0) + mass * CONSISTENCY.min_gyration**2
    about = (axes * extent) @ axes.T
    return np.block(
        [
            [about + np.outer(moment, moment) / mass, moment[:, None]],
            [moment[None], np.array([[mass]])],
        ]
    )
