"""Inertias that a body can have."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def nearest_possible_inertia(inertia: Array) -> Array:
    """The nearest inertia (3, 3) [kg·m²] of a body to a tensor, in the Frobenius norm of its
    distribution of mass.

    The second moments of the mass, trace(I)/2 - I, must not be negative along any axis (Traversaro
    et al., "Identification of fully physical consistent inertial parameters using optimization on
    manifolds", 2016): negative ones become zero.
    """
    symmetric = (inertia + inertia.T) / 2
    moments, axes = np.linalg.eigh(np.trace(symmetric) / 2 * np.eye(3) - symmetric)
    second = (axes * np.maximum(moments, 0.0)) @ axes.T
    return np.asarray(np.trace(second) * np.eye(3) - second)
