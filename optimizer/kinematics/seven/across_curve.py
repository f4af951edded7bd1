"""Newton's method onto the self-motion of a pose, across given directions, for many points at
once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain


@dataclass(frozen=True)
class AcrossSettings:
    """Settings of the projection onto a curve."""

    regularisation: float = 1e-14
    """Addition to the diagonal of a possibly singular system."""
    steps: int = 8
    """Largest number of steps."""
    last_step: float = 1e-6
    """Joint movement below which a step is the last [rad]."""


ACROSS = AcrossSettings()


def step_across(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array]:
    """First-order steps onto the self-motion of a flange pose, and tangents.

    Args:
        chain: chain of the arm.
        q: configurations, shape (n, nq) [rad].
        along: directions that the steps are perpendicular to, shape (n, nq).
        T: flange pose (4, 4).

    Returns:
        The steps (n, nq) [rad], and tangents (n, nq) at q, of any length, on the side of `along`.
    """
    reached, jacobian = chain.flange_and_columns(q)
    error = sine_error(reached, T)
    sides = np.zeros((*q.shape, 2))
    sides[:, :-1, 0], sides[:, -1, 1] = error, 1.0
    found = np.asarray(np.linalg.solve(_system(jacobian, along), sides), dtype=float)
    return found[:, :, 0], found[:, :, 1]


def project_across(chain: Chain, q: Array, along: Array, T: Array) -> Array:
    """Configurations (n, nq) [rad] of the self-motion of T (4, 4) next to q (n, nq), across `along`
    (n, nq), by Newton's method.
    """
    q, rows = q.copy(), np.arange(len(q))
    for _ in range(ACROSS.steps):
        if not len(rows):
            break
        move, _ = step_across(chain, q[rows], along[rows], T)
        q[rows] += move
        # The error left is of the order of the square of a step.
        rows = rows[np.abs(move).max(axis=1) > ACROSS.last_step]
    return q


def _system(jacobian: Array, along: Array) -> Array:
    """Matrices (n, nq, nq) of Jacobians (6, nq, n) above directions (n, nq), regularised."""
    n, nq = along.shape
    system = np.empty((n, nq, nq))
    system[:, :-1], system[:, -1] = jacobian.transpose(2, 0, 1), along
    system.reshape(n, -1)[:, :: nq + 1] += ACROSS.regularisation
    return system


def sine_error(reached: Array, T: Array) -> Array:
    """Pose errors (n, 6) with the sine of the angle in place of the angle: equal to `pose_error` to
    third order.

    The rotation part is half the sum of the cross products of corresponding columns.

    Args:
        reached: poses as of `Chain.flange_components`, shape (3, n, 4).
        T: flange pose (4, 4).
    """
    first, second, third = (T[:3, :3] / 2).tolist()
    # Weights of the twelve components reached, in rows x, y, z of three axes and the position, in
    # the six components of the error.
    weights = [
        *([0.0, 0.0, 0.0, 0.0, -c, b] for b, c in zip(second, third, strict=True)),
        [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        *([0.0, 0.0, 0.0, c, 0.0, -a] for a, c in zip(first, third, strict=True)),
        [0.0, -1.0, 0.0, 0.0, 0.0, 0.0],
        *([0.0, 0.0, 0.0, -b, a, 0.0] for a, b in zip(first, second, strict=True)),
        [0.0, 0.0, -1.0, 0.0, 0.0, 0.0],
    ]
    error = reached.transpose(1, 0, 2).reshape(-1, 12) @ np.array(weights)
    error[:, :3] += T[:3, 3]
    return np.asarray(error)
