"""Pseudo-inertias: the ten parameters of a body as a symmetric matrix (4, 4), positive semidefinite
if it is real.

The matrix is [[Σ, h], [hᵀ, m]] with Σ = tr(I)/2·1 - I, the second moments of the mass (Wensing,
Kim, Slotine 2018).
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import BODY

# m; a body whose mass lies within such a ball or less is given that size, so that its matrix has an
# inverse
LEAST_GYRATION = 0.01


def _basis() -> Array:
    """The pseudo-inertias (10, 4, 4) of the ten unit parameters m, mx, my, mz, Ixx, Ixy, Iyy, Ixz,
    Iyz, Izz.
    """
    units = np.zeros((BODY, 4, 4))
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
    """The matrices (bodies, 4, 4) of bodies with parameters (10 bodies,)."""
    return np.asarray(np.einsum("bk,kij->bij", parameters.reshape(-1, BODY), BASIS))


def nearness(parameters: Array) -> Array:
    """The matrix M (10 bodies, 10 bodies) of the squared distance xᵀ M x of bodies from those with
    these parameters.

    It does not depend on units or frames, and a change by the factor 1 + ε has a squared distance
    of 2 ε² per body (Lee, Wensing, Park 2020: the pullback of the affine-invariant metric).
    Published parameters of some arms are not those of real bodies: the distance is then that from
    the nearest ones.
    """
    matrices = pseudo_inertias(parameters)
    total = np.zeros((len(parameters),) * 2)
    for body, matrix in enumerate(matrices):
        inverse = np.linalg.inv(_real(matrix))
        turned = np.einsum("ij,kjl->kil", inverse, BASIS)
        at = slice(BODY * body, BODY * (body + 1))
        total[at, at] = np.einsum("kij,lji->kl", turned, turned) / 2
    return total


def _real(matrix: Array) -> Array:
    """The pseudo-inertia (4, 4) of a real body with some extent, nearest to one of any body."""
    mass, moment = max(float(matrix[3, 3]), 1e-6), matrix[:3, 3]
    # second moments about the centre of mass, none of which is below 0
    sizes, axes = np.linalg.eigh(matrix[:3, :3] - np.outer(moment, moment) / mass)
    about = (axes * (np.maximum(sizes, 0.0) + mass * LEAST_GYRATION**2)) @ axes.T
    return np.block(
        [
            [about + np.outer(moment, moment) / mass, moment[:, None]],
            [moment[None], np.array([[mass]])],
        ]
    )
