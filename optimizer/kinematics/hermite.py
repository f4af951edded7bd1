"""Cubic interpolation."""

from __future__ import annotations

from models.robot import Array


def hermite(share: Array, q0: Array, q1: Array, slope0: Array, slope1: Array) -> Array:
    """Values (n, m) at shares (n,), 0 to 1, of the way from q0 to q1 (n, m), by cubics with slopes (n, m) per way."""
    s = share[:, None]
    a, b = (1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2
    return a * q0 + (1 - a) * q1 + b * slope0 + s * s * (s - 1) * slope1
