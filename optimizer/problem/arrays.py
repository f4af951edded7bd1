"""Checks of a problem's arrays. Each returns a read-only copy; each error names the field."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from joulepath.models.arrays import read_only
from joulepath.models.robot import Array
from joulepath.models.shape_sizes import SIZES, WrongSize, check_lengths
from joulepath.optimizer.exceptions import InvalidProblem

Checked = TypeVar("Checked")

# of a rotation matrix: one assembled in double precision is orthonormal to about 1e-15
ORTHONORMAL = 1e-9
# a vector shorter than this has no direction [any unit]
SHORTEST_VECTOR = 1e-6


def frozen(values: object, shape: tuple[int, ...], field: str) -> Array:
    """A read-only, finite array of that shape, in which -1 stands for any length. Raises
    InvalidProblem.
    """
    try:
        return read_only(values, shape, field)
    except ValueError as error:
        raise InvalidProblem(field, str(error)) from None


def sized(field: str, check: Callable[[], Checked]) -> Checked:
    """What a check of a shape's size returns. Raises InvalidProblem at the field where it raises
    WrongSize.
    """
    try:
        return check()
    except WrongSize as error:
        raise InvalidProblem(field, str(error)) from None


def check_sizes(field: str, lengths: float | Array) -> None:
    """Raises InvalidProblem unless radii, lengths or edges [m] are those of a body."""
    sized(field, lambda: check_lengths(field, lengths))


def per_joint(values: object, count: int, field: str, least: float, most: float) -> Array:
    """Numbers (count,) within [least, most] from one number for all joints, or one each. Raises
    InvalidProblem.
    """
    given = [values] * count if np.ndim(values) == 0 else values  # type: ignore[arg-type]
    array = frozen(given, (count,), field)
    if not ((array >= least) & (array <= most)).all():
        raise InvalidProblem(field, f"{field} must lie between {least:g} and {most:g}.")
    return array


def unit_vector(values: object, field: str) -> Array:
    """The unit vector (3,) along a vector (3,) of any length. Raises InvalidProblem, also for the
    zero vector.
    """
    vector = frozen(values, (3,), field)
    length = float(np.linalg.norm(vector))
    if length < SHORTEST_VECTOR:
        raise InvalidProblem(field, f"{field} must not be zero: it gives a direction.")
    return frozen(vector / length, (3,), field)


def rigid_transform(values: object, field: str) -> Array:
    """A homogeneous matrix (4, 4) with an orthonormal, right-handed rotation. Raises
    InvalidProblem.
    """
    T = frozen(values, (4, 4), field)
    R = T[:3, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > ORTHONORMAL or np.linalg.det(R) < 0:
        raise InvalidProblem(
            field, f"The rotation matrix of {field} must be orthonormal and right-handed."
        )
    if T[3].tolist() != [0, 0, 0, 1]:
        raise InvalidProblem(field, f"The last row of the matrix of {field} must be 0, 0, 0, 1.")
    return T


def placement(values: object, field: str) -> Array:
    """Pose (4, 4) of a body, with its origin at most SIZES.largest from that of the frame. Raises
    InvalidProblem.
    """
    T = rigid_transform(values, field)
    if np.abs(T[:3, 3]).max() > SIZES.largest:
        raise InvalidProblem(field, f"{field} must lie within {SIZES.largest:g} m of the origin.")
    return T
