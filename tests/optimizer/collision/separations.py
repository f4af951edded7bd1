"""Separations of two bodies along a direction, from the definition."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body


def separation(first: Body, T_first: Array, second: Body, T_second: Array, normal: Array) -> float:
    """min n·x over the second body - max n·x over the first [m], with radii and margins, for a unit
    vector n in the base frame and poses of the links of both bodies.

    It never exceeds the signed distance, whatever n is. For a half-space, n must be its outward
    normal.
    """
    grown = first.core.radius + first.margin + second.core.radius + second.margin
    return _lowest(second, T_second, normal) + _lowest(first, T_first, -normal) - grown


def _lowest(body: Body, T: Array, normal: Array) -> float:
    """min n·x [m] over the core of a body."""
    in_core = (T @ body.T_link_core)[:3, :3].T @ normal
    disc = body.core.disc_radius * np.hypot(*in_core[:2])
    return float((body.points @ T[:3, :3].T @ normal).min() + T[:3, 3] @ normal - disc)
