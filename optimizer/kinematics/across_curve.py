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
# rows and columns of the products that make up two cross products, side by side
_BLOCK = np.array([0, 0, 0, 3, 3, 3])
_FIRST = np.array([1, 2, 0, 1, 2, 0])
_SECOND = np.array([2, 0, 1, 2, 0, 1]) + _BLOCK


def step_across(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array]:
    """Steps (n, nq) [rad] from q (n, nq), across the directions `along` (n, nq), to where the flange is at T (4, 4);
    and the tangents (n, nq) of its curve at q, with 1 for their product with `along`. Both to first order."""
    reached, jacobian = chain.flange_and_jacobian(q)
    sides = np.zeros((*q.shape, 2))
    sides[:, :-1, 0], sides[:, -1, 1] = nearly_error(reached, T), 1.0
    found = np.asarray(np.linalg.solve(_system(jacobian, along), sides), dtype=float)
    return found[:, :, 0], found[:, :, 1]


def step_to(chain: Chain, q: Array, along: Array, ahead: Array, T: Array) -> tuple[Array, Array]:
    """Steps (n, nq) [rad] from q (n, nq) to where the flange is at T (4, 4), with `ahead` (n,) for their product with
    `along` (n, nq); and the error (n,) [rad] of any joint that they leave, nearly.

    Newton's step and what the second order adds to it. With a ratio r of the two, what is left is some r² of the step.
    """
    reached, jacobian = chain.flange_and_jacobian(q)
    system, sides = _system(jacobian, along), np.empty((*q.shape, 1))
    sides[:, :-1, 0], sides[:, -1, 0] = nearly_error(reached, T), ahead
    move: Array = np.linalg.solve(system, sides)[:, :, 0].astype(float, copy=False)
    sides[:, :-1, 0], sides[:, -1, 0] = second_order(jacobian, move), 0.0
    more = np.linalg.solve(system, sides)[:, :, 0]
    first, second = np.maximum(np.abs(move).max(axis=1), NONE), np.abs(more).max(axis=1)
    small = second < first / 2
    return np.asarray(move - np.where(small[:, None], more, 0.0)), np.where(small, second**2 / first, first)


def _system(jacobian: Array, along: Array) -> Array:
    """Matrices (n, nq, nq) of Jacobians (n, nq - 1, nq) above directions (n, nq), next to singular ones at worst."""
    system = np.concatenate([jacobian, along[:, None]], axis=1)
    return np.asarray(system + TINY * np.eye(along.shape[1]))


def second_order(jacobian: Array, move: Array) -> Array:
    """The part (n, 6) [m, rad] of second order in the motion of the flange with a geometric Jacobian (n, 6, nq) along
    moves (n, nq) [rad]: of its place, and of the rotation vector.

    A joint turns all behind it, and so what a later one does: the second derivative by joints i <= j of the place is
    z_i × v_j, with v_j the velocity by joint j. The rotation vector has half the sum of z_i × z_j over i < j (Baker,
    Campbell, Hausdorff).
    """
    parts = jacobian * move[:, None, :]
    z = parts[:, 3:]
    # of the products of all components, the difference of two is one of the cross product
    products = (np.cumsum(z, axis=2) - z / 2) @ parts.transpose(0, 2, 1)
    found = products[:, _FIRST, _SECOND] - products[:, _SECOND % 3, _FIRST + _BLOCK]
    found[:, 3:] /= 2
    return np.asarray(found)


def onto(chain: Chain, q: Array, along: Array, T: Array) -> Array:
    """The configurations (n, nq) [rad] with the flange at T (4, 4) next to q (n, nq), across `along` (n, nq)."""
    q = q.copy()
    rows = np.arange(len(q))
    for _ in range(STEPS):
        if not len(rows):
            break
        move, left = step_to(chain, q[rows], along[rows], np.zeros(len(rows)), T)
        q[rows] += move
        rows = rows[left > LEFT]
    return q


def nearly_error(reached: Array, T: Array) -> Array:
    """`pose_error` (n, 6) of poses (n, 4, 4) against T (4, 4), with the sine of its angle: the same but for its cube.

    Of both poses' rotations it is half the sum of the products of their columns, so that one product gives it all.
    """
    weights = np.zeros((3, 4, 6))
    R = T[:3, :3] / 2
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        weights[x, 3, x] = -1.0
        weights[y, :3, 3 + x], weights[z, :3, 3 + x] = R[z], -R[y]
    error = reached[:, :3].reshape(len(reached), 12) @ weights.reshape(12, 6)
    error[:, :3] += T[:3, 3]
    return np.asarray(error)
