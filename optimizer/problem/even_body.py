"""Payloads of one density: centre of mass and inertia from the shape."""

from __future__ import annotations

from functools import singledispatch
from math import pi
from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.scene import Attachment, Box, Capsule, Cylinder, Mesh, Sphere


@checked_arguments
def even_payload(mass: float, shape: Attachment) -> Payload:
    """A payload of one density that fills its shape: a part of which mass and size are known.

    Args:
        mass: mass [kg].
        shape: its shape, with its pose in the flange frame.

    Returns:
        The payload, with the centre of mass and the inertia that follow.

    Raises:
        InvalidProblem: no body has this mass, or an argument has another type.
    """
    centre, moments = _spread(shape.shape)
    R, p = shape.T_flange_shape[:3, :3], shape.T_flange_shape[:3, 3]
    moments = R @ moments @ R.T
    inertia = mass * (np.trace(moments) * np.eye(3) - moments)
    return Payload(mass, R @ centre + p, inertia, shape)


@singledispatch
def _spread(shape: Any) -> tuple[Array, Array]:
    """Centre (3,) [m] of a shape, and the mean of x xᵀ over its volume, with x from the centre,
    shape (3, 3) [m²].
    """
    raise TypeError(f"{type(shape).__name__} cannot be carried.")


@_spread.register
def _(shape: Sphere) -> tuple[Array, Array]:
    return np.zeros(3), shape.radius**2 / 5 * np.eye(3)


@_spread.register
def _(shape: Cylinder) -> tuple[Array, Array]:
    across = shape.radius**2 / 4
    return np.zeros(3), np.diag([across, across, shape.length**2 / 12])


@_spread.register
def _(shape: Capsule) -> tuple[Array, Array]:
    r, length = shape.radius, shape.length
    middle, ends = pi * r**2 * length, 4 / 3 * pi * r**3
    across = middle * r**2 / 4 + ends * r**2 / 5
    # the centre of a half ball is 3/8 of its radius from its plane
    along = middle * length**2 / 12 + ends * (r**2 / 5 + 3 / 8 * r * length + length**2 / 4)
    return np.zeros(3), np.diag([across, across, along]) / (middle + ends)


@_spread.register
def _(shape: Box) -> tuple[Array, Array]:
    return np.zeros(3), np.diag(shape.size**2) / 12


@_spread.register
def _(shape: Mesh) -> tuple[Array, Array]:
    from scipy.spatial import ConvexHull  # as in `hull_of_body`

    origin = shape.vertices.mean(axis=0)
    # tetrahedra between a point within the hull and its faces
    faces = shape.vertices[ConvexHull(shape.vertices).simplices] - origin
    share = np.abs(np.linalg.det(faces))
    share /= share.sum()
    sums = faces.sum(axis=1)
    centre = share @ sums / 4
    # mean of x xᵀ over a tetrahedron with corners 0, a, b, c: (aaᵀ + bbᵀ + ccᵀ + ssᵀ) / 20
    corners = np.einsum("n,nki,nkj->ij", share, faces, faces)
    moments = (corners + np.einsum("n,ni,nj->ij", share, sums, sums)) / 20
    return origin + centre, moments - np.outer(centre, centre)
