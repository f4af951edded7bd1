"""Many points in other frames.

Components come first and cases last, as in (3, k): numpy runs along the cases, several times as
fast as along three components.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.cores import Indices


def pose_columns(T: Array) -> Array:
    """Poses T (..., 4, 4) as columns (3, 4, k), the last of their indices running fastest."""
    return np.ascontiguousarray(T[..., :3, :].reshape(-1, 12).T).reshape(3, 4, -1)


def picked(columns: Array, k: Indices) -> Array:
    """Some of the columns (..., n)."""
    return columns.take(k, axis=-1)


def placed(T: Array, points: Array) -> Array:
    """Points (..., 3, k) [m] by poses T (3, 4, k)."""
    x, y, z = (points[..., i, None, :] for i in range(3))
    return np.asarray(T[:, 0] * x + T[:, 1] * y + T[:, 2] * z + T[:, 3])


def into(T: Array, points: Array) -> Array:
    """Points (..., 3, k) [m] in the frames of poses T (3, 4, k)."""
    x, y, z = (points[..., i, None, :] - T[i, 3] for i in range(3))
    return np.asarray(T[0, :3] * x + T[1, :3] * y + T[2, :3] * z)


def turned(T: Array, vectors: Array) -> Array:
    """Vectors (3, k) by the rotations of poses T (3, 4, k)."""
    return np.asarray(T[:, 0] * vectors[0] + T[:, 1] * vectors[1] + T[:, 2] * vectors[2])
