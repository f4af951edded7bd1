"""Arrays of a problem: read-only, of the right shape, finite; rotations orthonormal."""

from __future__ import annotations

import numpy as np

from models.robot import Array
from optimizer.exceptions import InvalidProblem


def frozen(values: object, shape: tuple[int, ...], name: str) -> Array:
    """A read-only array of that shape. Raises InvalidProblem, with the field named."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InvalidProblem(name, f"{name} must be numbers.") from None
    if array.shape != shape:
        raise InvalidProblem(name, f"{name} must have shape {shape}, not {array.shape}.")
    if not np.isfinite(array).all():
        raise InvalidProblem(name, f"{name} must be finite.")
    array.setflags(write=False)
    return array


def per_joint(values: object, count: int, name: str, least: float, most: float) -> Array:
    """Numbers (count,) within [least, most] from one number or one each. Raises InvalidProblem."""
    array = frozen(np.full(count, values) if np.ndim(values) == 0 else values, (count,), name)  # type: ignore[arg-type]
    if not ((array >= least) & (array <= most)).all():
        raise InvalidProblem(name, f"{name} must lie between {least:g} and {most:g}.")
    return array


LARGEST = 100.0


def placement(name: str, T: Array) -> Array:
    """A read-only pose (4, 4) within reach of reason. Raises InvalidProblem."""
    T = numbers(name, T, (4, 4))
    rotation = T[:3, :3]
    # 1e-9: a rotation assembled in double precision is orthonormal to about 1e-15
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-9 or np.linalg.det(rotation) < 0:
        raise InvalidProblem(name, "The pose's rotation matrix must be orthonormal and right-handed.")
    if np.abs(T[:3, 3]).max() > LARGEST:
        raise InvalidProblem(name, f"The pose must lie within {LARGEST:g} m of the origin.")
    return T


def numbers(name: str, values: object, shape: tuple[int, ...]) -> Array:
    """A read-only array of that shape, -1 standing for any length. Raises InvalidProblem, with the field named."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InvalidProblem(name, f"{name} must be numbers.") from None
    if array.ndim != len(shape) or any(want not in (-1, got) for want, got in zip(shape, array.shape, strict=True)):
        raise InvalidProblem(name, f"{name} has the wrong shape.")
    if not np.isfinite(array).all():
        raise InvalidProblem(name, f"{name} must be finite.")
    array.setflags(write=False)
    return array
