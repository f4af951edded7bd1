"""Newton's method onto the curve of configurations that hold a pose, across given directions: n points at once."""

from __future__ import annotations

import numpy as np

from models.robot import Array
from optimizer.kinematics.chain import Chain

# added to the diagonal of a system that may be singular
TINY = 1e-14
# steps, and the change of any joint [rad] after which the error left, a part of its square, is some 1e-12
STEPS, LAST = 5, 3e-7


def step_across(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array]:
    """Steps (n, nq) [rad] from q (n, nq), across the directions `along` (n, nq), to where the flange is at T (4, 4);
    and the tangents (n, nq) of its curve at q, with 1 for their product with `along`. Both to first order."""
    reached, jacobian = chain.flange_and_jacobian(q)
    n, nq = q.shape
    system, sides = np.empty((n, nq, nq)), np.zeros((n, nq, 2))
    system[:, :-1], system[:, -1] = jacobian, along
    sides[:, :-1, 0], sides[:, -1, 1] = nearly_error(reached, T), 1.0
    found = np.asarray(np.linalg.solve(system + TINY * np.eye(nq), sides), dtype=float)
    return found[:, :, 0], found[:, :, 1]


def onto(chain: Chain, q: Array, along: Array, T: Array) -> Array:
    """The configurations (n, nq) [rad] with the flange at T (4, 4) next to q (n, nq), across `along` (n, nq)."""
    q = q.copy()
    rows = np.arange(len(q))
    for _ in range(STEPS):
        if not len(rows):
            break
        move, _ = step_across(chain, q[rows], along[rows], T)
        q[rows] += move
        rows = rows[np.abs(move).max(axis=1) > LAST]
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
