"""Checks of a problem's arrays: they return read-only copies, and their errors name the field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from joulepath.models.arrays import read_only
from joulepath.models.robot import Array
from joulepath.models.shape_sizes import SIZES, WrongSize
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.scalars import check_number

Checked = TypeVar("Checked")


@dataclass(frozen=True)
class ArraySettings:
    """Tolerances of the checks."""

    orthonormal: float = 1e-9
    """Greatest deviation of R Rᵀ from the identity; double precision gives about 1e-15."""
    shortest_vector: float = 1e-6
    """Length below which a vector has no direction, in its unit."""


ARRAYS = ArraySettings()


def frozen(values: object, shape: tuple[int, ...], field: str) -> Array:
    """Read-only, finite array of a given shape; -1 in the shape stands for any length.

    Raises:
        InvalidProblem: the values do not form such an array.
    """
    try:
        return read_only(values, shape, field)
    except ValueError as error:
        raise InvalidProblem(field, str(error)) from None


def sized(field: str, check: Callable[[], Checked]) -> Checked:
    """Result of a check of a shape's size.

    Raises:
        InvalidProblem: the check raised WrongSize.
    """
    try:
        return check()
    except WrongSize as error:
        raise InvalidProblem(field, str(error)) from None


def check_size(field: str, length: object) -> None:
    """Check a radius, a length or an edge [m] of a body.

    Raises:
        InvalidProblem: no body has this size.
    """
    check_number(field, length, "metres", least=SIZES.smallest, most=SIZES.largest)


def per_joint(values: object, count: int, field: str, least: float, most: float) -> Array:
    """Numbers (count,) within [least, most], from one number for all joints or one per joint.

    Raises:
        InvalidProblem: the values have another shape or are out of range.
    """
    given = [values] * count if np.ndim(values) == 0 else values  # type: ignore[arg-type]
    array = frozen(given, (count,), field)
    if not ((array >= least) & (array <= most)).all():
        raise InvalidProblem(field, f"{field} must lie between {least:g} and {most:g}.")
    return array


def unit_vector(values: object, field: str) -> Array:
    """Unit vector (3,) along a vector of any length.

    Raises:
        InvalidProblem: the vector is malformed or zero.
    """
    vector = frozen(values, (3,), field)
    length = float(np.linalg.norm(vector))
    if length < ARRAYS.shortest_vector:
        raise InvalidProblem(field, f"{field} must not be zero: it gives a direction.")
    return frozen(vector / length, (3,), field)


def rigid_transform(values: object, field: str) -> Array:
    """Homogeneous matrix (4, 4) with an orthonormal, right-handed rotation.

    Raises:
        InvalidProblem: the matrix is no rigid transform.
    """
    T = frozen(values, (4, 4), field)
    R = T[:3, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > ARRAYS.orthonormal or np.linalg.det(R) < 0:
        raise InvalidProblem(
            field, f"The rotation matrix of {field} must be orthonormal and right-handed."
        )
    if T[3].tolist() != [0, 0, 0, 1]:
        raise InvalidProblem(field, f"The last row of the matrix of {field} must be 0, 0, 0, 1.")
    return T


def placement(values: object, field: str) -> Array:
    """Pose (4, 4) of a body with its origin at most `SIZES.largest` from the origin of the frame.

    Raises:
        InvalidProblem: the matrix is no rigid transform, or too far away.
    """
    T = rigid_transform(values, field)
    if np.abs(T[:3, 3]).max() > SIZES.largest:
        raise InvalidProblem(field, f"{field} must lie within {SIZES.largest:g} m of the origin.")
    return T
