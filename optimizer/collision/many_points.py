"""Many points in other frames.

They are sums of products of long arrays: as many small products of matrices they take twice the time.
"""

from __future__ import annotations

import numpy as np

from models.robot import Array


def placed(T: Array, points: Array) -> Array:
    """Points (..., 3) [m] by poses T (..., 4, 4)."""
    x, y, z = (points[..., i, None] for i in range(3))
    return np.asarray(T[..., :3, 0] * x + T[..., :3, 1] * y + T[..., :3, 2] * z + T[..., :3, 3])


def into(T: Array, points: Array) -> Array:
    """Points (..., 3) [m] in the frames of poses T (..., 4, 4)."""
    x, y, z = (points[..., i, None] - T[..., i, 3, None] for i in range(3))
    return np.asarray(T[..., 0, :3] * x + T[..., 1, :3] * y + T[..., 2, :3] * z)


def cross(a: Array, b: Array) -> Array:
    """Products a × b (..., 3)."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return result
