"""Physically possible inertias."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def nearest_possible_inertia(inertia: Array) -> Array:
    """The physically possible inertia tensor nearest to a tensor (3, 3) [kg·m²].

    The distance is the Frobenius norm of the difference of the second moments of mass, trace(I)/2 -
    I. Second moments must not be negative along any axis (Traversaro et al., "Identification of
    fully physical consistent inertial parameters using optimization on manifolds", 2016): negative
    second moments become zero.
    """
    symmetric = (inertia + inertia.T) / 2
    moments, axes = np.linalg.eigh(np.trace(symmetric) / 2 * np.eye(3) - symmetric)
    second = (axes * np.maximum(moments, 0.0)) @ axes.T
    return np.asarray(np.trace(second) * np.eye(3) - second)
