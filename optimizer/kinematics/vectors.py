"""Cross products of many short vectors."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def cross(a: Array, b: Array) -> Array:
    """Cross product a × b of vectors (..., 3), several times faster than NumPy's for few
    vectors.
    """
    x, y, z, u, v, w = a[..., 0], a[..., 1], a[..., 2], b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0], product[..., 1], product[..., 2] = y * w - z * v, z * u - x * w, x * v - y * u
    return product
