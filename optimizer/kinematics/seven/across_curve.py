"""Newton's method onto the curve of configurations that hold a pose, across given directions: n
points at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain

# added to the diagonal of a system that may be singular; square of a length that is none
TINY, NO_SQUARE = 1e-14, 1e-28
# steps, and the error of any joint [rad] that needs no other
STEPS, LEFT = 5, 2e-11
# length [rad] of no step
NONE = 1e-300
# share of a step that the second order adds to it, below which it is added, and below which the
# step's matrices serve for another one
HALF, ALIKE = 0.5, 0.1
# points from which on they are solved for side by side: LAPACK takes as long for each of them
MANY = 128


def step_across(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array]:
    """Steps (n, nq) [rad] from q (n, nq), across the directions `along` (n, nq), to where the
    flange is at T (4, 4); and tangents (n, nq) of its curve at q, of any length, towards `along`.
    Both to first order."""
    reached, jacobian = chain.flange_and_columns(q)
    error = nearly_error(reached, T)
    if len(q) >= MANY:
        return _side_by_side(jacobian, along, error)
    sides = np.zeros((*q.shape, 2))
    sides[:, :-1, 0], sides[:, -1, 1] = error, 1.0
    found = np.asarray(np.linalg.solve(_system(jacobian, along), sides), dtype=float)
    return found[:, :, 0], found[:, :, 1]


def _side_by_side(jacobian: Array, along: Array, error: Array) -> tuple[Array, Array]:
    """The same with Jacobians (6, nq, n) and errors (n, 6), all points in a row.

    The rows of the system are made orthogonal one after the other, with their right sides (Gram and
    Schmidt, modified: it needs no choice of pivots). The last one, `along`, then is a tangent.
    """
    count, nq, n = jacobian.shape
    rows = np.zeros((count + 1, nq + 1, n))
    rows[:-1, :-1], rows[:-1, -1], rows[-1, :-1] = jacobian, error.T, along.T
    for k in range(count + 1):
        row, rest = rows[k], rows[k + 1 :]
        side = row[:-1]
        # divided by the square of its length, a row's right side is its share of the step
        scaled = side / np.maximum(np.einsum("jn,jn->n", side, side), NO_SQUARE)
        if len(rest):
            rest -= np.einsum("ijn,jn->in", rest[:, :-1], scaled)[:, None] * row
        else:
            tangent = side.copy()
        side[:] = scaled
    return np.einsum("in,ijn->nj", rows[:, -1], rows[:, :-1]), tangent.T


def led(
    chain: Chain, q: Array, along: Array, ahead: Array, T: Array, longest: float = np.inf
) -> tuple[Array, Array]:
    """The configurations (n, nq) [rad] next to q (n, nq) that have the flange at T (4, 4),
    displaced by `ahead` (n,) in the directions `along` (n, nq), as a scalar product; and an
    estimate of the greatest joint error (n,) [rad] left.

    Newton's method with its step and what the second order adds to it: with a ratio r of the two,
    what is left is some r² of the step. Where r is small, the next step takes the same matrices
    (the chord method): it leaves some 2 r of itself. No joint moves by more than `longest` [rad] in
    a step.
    """
    q, ahead, left, rows = q.copy(), ahead.copy(), np.empty(len(q)), np.arange(len(q))
    for _ in range(STEPS):
        move, left[rows], ratio, inverse = _step(chain, q[rows], along[rows], ahead[rows], T)
        _advance(q, ahead, along, rows, np.minimum(np.maximum(move, -longest), longest))
        (again,) = ((left[rows] > LEFT) & (ratio < ALIKE)).nonzero()
        if len(again):
            here, sides = rows[again], np.empty((len(again), q.shape[1]))
            sides[:, :-1], sides[:, -1] = (
                nearly_error(chain.flange_components(q[here]), T),
                ahead[here],
            )
            move = np.einsum("nij,nj->ni", inverse[again], sides)
            _advance(q, ahead, along, here, np.minimum(np.maximum(move, -longest), longest))
            left[here] = 2 * ratio[again] * np.maximum.reduce(np.abs(move), axis=1)
        (rows,) = (left > LEFT).nonzero()
        if not len(rows):
            break
    return q, left


def _advance(q: Array, ahead: Array, along: Array, rows: NDArray[np.intp], move: Array) -> None:
    """Moves (m, nq) of rows (m,) of q (n, nq), which shorten what is ahead (n,) of them along given
    directions.
    """
    q[rows] += move
    ahead[rows] -= np.einsum("ij,ij->i", move, along[rows])


def _step(
    chain: Chain, q: Array, along: Array, ahead: Array, T: Array
) -> tuple[Array, Array, Array, Array]:
    """A step (n, nq) of `led` and what it leaves (n,), the ratio (n,) of the second order to the
    first, and the inverse matrices (n, nq, nq)."""
    reached, jacobian = chain.flange_and_columns(q)
    inverse, sides = (
        np.asarray(np.linalg.inv(_system(jacobian, along)), dtype=float),
        np.zeros(q.shape),
    )
    sides[:, :-1], sides[:, -1] = nearly_error(reached, T), ahead
    move: Array = np.einsum("nij,nj->ni", inverse, sides)
    more: Array = np.einsum("nij,jn->ni", inverse[:, :, :-1], second_order(jacobian, move.T))
    first, second = (np.maximum.reduce(np.abs(each), axis=1) for each in (move, more))
    first = np.maximum(first, NONE)
    ratio: Array = second / first
    small = ratio < HALF
    return (
        move - np.where(small[:, None], more, 0.0),
        np.where(small, ratio * second, first),
        ratio,
        inverse,
    )


def _system(jacobian: Array, along: Array) -> Array:
    """Matrices (n, nq, nq) of Jacobians (6, nq, n) above directions (n, nq), next to singular ones
    at worst.
    """
    n, nq = along.shape
    system = np.empty((n, nq, nq))
    system[:, :-1], system[:, -1] = jacobian.transpose(2, 0, 1), along
    system.reshape(n, -1)[:, :: nq + 1] += TINY
    return system


def second_order(jacobian: Array, move: Array) -> Array:
    """The part (6, n) [m, rad] of second order in the motion of the flange with a geometric
    Jacobian (6, nq, n) along moves (nq, n) [rad]: of its place, and of the rotation vector.

    A joint turns all behind it, and so what a later one does: the second derivative by joints i <=
    j of the place is z_i × v_j, with v_j the velocity by joint j. The rotation vector has half the
    sum of z_i × z_j over i < j (Baker, Campbell, Hausdorff).
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
    """The configurations (n, nq) [rad] with the flange at T (4, 4) next to q (n, nq), across
    `along` (n, nq).
    """
    return led(chain, q, along, np.zeros(len(q)), T)[0]


def nearly_error(reached: Array, T: Array) -> Array:
    """`pose_error` (n, 6) of poses (3, n, 4), as of `flange_components`, against T (4, 4), with the
    sine of its angle: the same but for its cube.

    Of both poses' rotations it is half the sum of the products of their columns.
    """
    first, second, third = (T[:3, :3] / 2).tolist()
    # what is reached, by rows x, y, z of three rotated and one shifted component, makes the six of
    # the error
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
