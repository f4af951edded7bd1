"""Validation of the sizes of shapes in URDFs, requests and figures of robots.

A shape without extent would never collide, and any motion through it would look free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array


@dataclass(frozen=True)
class ShapeSizes:
    """Allowed sizes of shapes."""

    smallest: float = 1e-4
    """Least radius, length, edge or extent [m]; smaller shapes have mistaken units."""
    largest: float = 100.0
    """Greatest size, and greatest distance of a part from its frame [m]."""
    flat: float = 1e-6
    """Least ratio of smallest to largest extent of a body, for a volume above rounding errors."""


SIZES = ShapeSizes()


class WrongSize(ValueError):
    """The size of a shape is implausible. The message begins with the `name` of the check."""


def check_lengths(name: str, values: float | Array, largest: float = SIZES.largest) -> None:
    """Raises WrongSize unless all lengths [m] are between the smallest size and `largest`."""
    given = np.ravel(values)
    # This form refuses NaN.
    wrong = given[~((SIZES.smallest <= given) & (given <= largest))]
    if wrong.size:
        raise WrongSize(
            f"{name} must be between {SIZES.smallest:g} and {largest:g} m, not {wrong[0]:g}."
        )


def check_extent(name: str, points: Array) -> None:
    """Raises WrongSize if points (n, 3) [m] are not finite, or all lie within the smallest size."""
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if not SIZES.smallest <= extent < np.inf:
        raise WrongSize(
            f"{name} must extend over {SIZES.smallest:g} m or more, not {extent:g} m: correct its "
            "points or its scale."
        )


def check_scale(name: str, scale: Array, points: Array) -> None:
    """Raises WrongSize for scale factors (3,) flattening points (n, 3).

    Negative factors mirror the points and are allowed.
    """
    factors, extents = np.abs(scale), np.ptp(points, axis=0)
    pressed = (extents * factors < SIZES.smallest) & (extents * factors.max() >= SIZES.smallest)
    if (factors == 0).any() or pressed.any():
        raise WrongSize(
            f"{name} must not flatten the mesh, as {' '.join(f'{each:g}' for each in scale)} does."
        )
    check_extent(f"{name} is wrong: the mesh", points * scale)


def check_surface(name: str, points: Array) -> None:
    """Raises WrongSize if points (n, 3) [m] lie within the smallest size, or on one line."""
    check_extent(name, points)
    extents = np.linalg.svd(points - points.mean(axis=0), full_matrices=False, compute_uv=False)
    if extents[1] <= SIZES.flat * extents[0]:
        raise WrongSize(f"{name} lies on one line: give a surface or a body.")


def hull_of_body(name: str, points: Array) -> Array:
    """The corners (k, 3) of the convex hull of points (n, 3) [m].

    Raises WrongSize if they lie within the smallest size, or in a plane; the message begins with
    `name`.
    """
    # here: its import takes longer than all others of a first problem
    from scipy.spatial import ConvexHull, QhullError

    check_extent(name, points)
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    try:
        if extents[2] > SIZES.flat * extents[0]:
            return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        pass
    raise WrongSize(f"{name} lie in a plane: give points of a body with a volume.")
