"""Piecewise linear joint paths: lengths, smooth samples, and comparison."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.motion import quintic


@dataclass(frozen=True)
class JointPathSettings:
    """Sampling and comparison of joint paths."""

    samples: int = 201
    """Samples of a path."""
    rounding: float = 0.06
    """Fraction of the length of a path, on either side, over which its corners are averaged."""
    rounding_points: int = 9
    """Points of the average."""
    same_path: float = 0.5
    """Largest difference [rad] of a joint, at the same fractions of the lengths, between paths that
    count as equal.
    """
    interpolated_samples: int = 33
    """Samples of two paths between which is interpolated."""
    interpolation_steps: int = 9
    """Steps from one path to the other."""
    allowed_penetration: float = 0.02
    """Penetration [m] allowed to interpolated configurations: motions that pass an obstacle on the
    same side touch it, and interpolation may cut its corners.
    """


JOINT_PATH = JointPathSettings()


def path_samples(path: Array, duration: float, v_max: Array) -> tuple[Array, Array]:
    """Samples q (k, nq) [rad] of a path at times t (k,) [s]: at rest at both ends, with rounded
    corners.

    The fraction of the path's length, with joint displacements divided by v_max (nq,) [rad/s], is
    10 τ³ - 15 τ⁴ + 6 τ⁵ at τ = t / duration.
    """
    reached = path_lengths(path, v_max)
    tau = np.linspace(0.0, 1.0, JOINT_PATH.samples)
    fraction = quintic.fraction(tau)
    # Mean over a window that narrows to zero at the ends, since the ends must not move.
    half_window = np.minimum(JOINT_PATH.rounding, np.minimum(fraction, 1 - fraction))
    averaged = fraction[:, None] + half_window[:, None] * np.linspace(
        -1.0, 1.0, JOINT_PATH.rounding_points
    )
    q = np.stack(
        [np.interp(averaged, reached / reached[-1], joint).mean(axis=1) for joint in path.T], axis=1
    )
    return q, tau * duration


def path_length(path: Array, v_max: Array) -> float:
    """Weighted length [s] of a joint path: sum over its steps of the norm of Δq / v_max.

    It is the least duration under the limit ‖v / v_max‖ ≤ 1.
    """
    return float(path_lengths(path, v_max)[-1])


def interpolation_is_free(model: CollisionModel, path: Array, other: Array) -> bool:
    """Whether linear interpolation between two joint paths is collision-free up to
    `allowed_penetration`.

    The paths (k, nq) [rad] are sampled at the same times. If the interpolation is free, an
    optimiser usually finds the same motion from either path.
    """
    chosen = np.linspace(0, len(path) - 1, JOINT_PATH.interpolated_samples).round().astype(int)
    steps = np.linspace(0.0, 1.0, JOINT_PATH.interpolation_steps + 2)[1:-1, None, None]
    q = (1 - steps) * path[chosen] + steps * other[chosen]
    return (
        model.least_distance(q.reshape(-1, path.shape[1]), 0.0) >= -JOINT_PATH.allowed_penetration
    )


def path_lengths(path: Array, v_max: Array) -> Array:
    """Weighted length (k,) [s] from the start of a path to its points, as in `path_length`."""
    steps = np.linalg.norm(np.diff(path, axis=0) / v_max, axis=1)
    return np.append(0.0, np.cumsum(steps))


def is_same_path(path: Array, other: Array) -> bool:
    """Whether two paths differ by less than `same_path` at the same fractions of their lengths."""
    ones = np.ones(path.shape[1])
    (q, _), (q_other, _) = (path_samples(each, 1.0, ones) for each in (path, other))
    return bool(np.abs(q - q_other).max() < JOINT_PATH.same_path)
