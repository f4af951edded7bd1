"""Newton's method onto the curve of configurations that hold a pose, across given directions: n points at once."""

from __future__ import annotations

import numpy as np

from models.robot import Array
from optimizer.kinematics.chain import Chain

# added to the diagonal of a system that may be singular
TINY = 1e-14
# steps, and the error of any joint [rad] that needs no other
STEPS, LEFT = 5, 1e-12
# length [rad] of no step
NONE = 1e-300


def step_across(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array]:
    """Steps (n, nq) [rad] from q (n, nq), across the directions `along` (n, nq), to where the flange is at T (4, 4);
    and the tangents (n, nq) of its curve at q, with 1 for their product with `along`. Both to first order."""
    reached, jacobian = chain.flange_and_columns(q)
    sides = np.zeros((*q.shape, 2))
    sides[:, :-1, 0], sides[:, -1, 1] = nearly_error(reached, T).T, 1.0
    found = np.asarray(np.linalg.solve(_system(jacobian, along), sides), dtype=float)
    return found[:, :, 0], found[:, :, 1]


def step_to(chain: Chain, q: Array, along: Array, ahead: Array, T: Array) -> tuple[Array, Array]:
    """Steps (n, nq) [rad] from q (n, nq) to where the flange is at T (4, 4), with `ahead` (n,) for their product with
    `along` (n, nq); and the error (n,) [rad] of any joint that they leave, nearly.

    Newton's step and what the second order adds to it. With a ratio r of the two, what is left is some r² of the step.
    """
    reached, jacobian = chain.flange_and_columns(q)
    system, sides = _system(jacobian, along), np.empty((*q.shape, 1))
    sides[:, :-1, 0], sides[:, -1, 0] = nearly_error(reached, T).T, ahead
    move: Array = np.linalg.solve(system, sides)[:, :, 0].astype(float, copy=False)
    sides[:, :-1, 0], sides[:, -1, 0] = second_order(jacobian, move.T).T, 0.0
    more = np.linalg.solve(system, sides)[:, :, 0]
    first, second = (np.maximum.reduce(np.abs(each), axis=1) for each in (move, more))
    first, small = np.maximum(first, NONE), second < first / 2
    return np.asarray(move - np.where(small[:, None], more, 0.0)), np.where(small, second**2 / first, first)


def _system(jacobian: Array, along: Array) -> Array:
    """Matrices (n, nq, nq) of Jacobians (6, nq, n) above directions (n, nq), next to singular ones at worst."""
    n, nq = along.shape
    system = np.empty((n, nq, nq))
    system[:, :-1], system[:, -1] = jacobian.transpose(2, 0, 1), along
    system.reshape(n, -1)[:, :: nq + 1] += TINY
    return system


def second_order(jacobian: Array, move: Array) -> Array:
    """The part (6, n) [m, rad] of second order in the motion of the flange with a geometric Jacobian (6, nq, n) along
    moves (nq, n) [rad]: of its place, and of the rotation vector.

    A joint turns all behind it, and so what a later one does: the second derivative by joints i <= j of the place is
    z_i × v_j, with v_j the velocity by joint j. The rotation vector has half the sum of z_i × z_j over i < j (Baker,
    Campbell, Hausdorff).
    """
    parts = jacobian * move
    z = parts[3:]
    x, y, z = np.cumsum(z, axis=1) - z / 2
    u, v, w = parts.reshape(2, 3, *move.shape).transpose(1, 0, 2, 3)
    found = np.empty((2, 3, move.shape[1]))
    for k, product in enumerate((y * w - z * v, z * u - x * w, x * v - y * u)):
        np.add.reduce(product, axis=1, out=found[:, k])
    found[1] /= 2
    return found.reshape(6, -1)


def onto(chain: Chain, q: Array, along: Array, T: Array) -> Array:
    """The configurations (n, nq) [rad] with the flange at T (4, 4) next to q (n, nq), across `along` (n, nq)."""
    move, left = step_to(chain, q, along, np.zeros(len(q)), T)
    q = q + move
    for _ in range(STEPS - 1):
        (rows,) = (left > LEFT).nonzero()
        if not len(rows):
            break
        move, left_there = step_to(chain, q[rows], along[rows], np.zeros(len(rows)), T)
        q[rows] += move
        left = np.zeros(len(q))
        left[rows] = left_there
    return q


def nearly_error(reached: Array, T: Array) -> Array:
    """`pose_error` (6, n) of poses (3, n, 4), as of `flange_and_columns`, against T (4, 4), with the sine of its angle:
    the same but for its cube.

    Of both poses' rotations it is half the sum of the products of their columns.
    """
    weights = np.zeros((4, 4))
    weights[:3, :3], weights[3, 3] = T[:3, :3].T / 2, -1.0
    x, y, z = (reached.reshape(-1, 4) @ weights).reshape(reached.shape).transpose(0, 2, 1)
    error = np.empty((6, reached.shape[1]))
    error[0], error[1], error[2] = x[3], y[3], z[3]
    error[:3] += T[:3, 3, None]
    error[3], error[4], error[5] = y[2] - z[1], z[0] - x[2], x[1] - y[0]
    return error
