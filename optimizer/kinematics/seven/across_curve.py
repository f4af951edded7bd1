"""Newton's method onto the self-motion of a pose, across given directions, for many points at
once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain


@dataclass(frozen=True)
class AcrossSettings:
    """Settings of the projection onto a curve."""

    regularisation: float = 1e-14
    """Addition to the diagonal of a possibly singular system."""
    least_square: float = 1e-28
    """Smallest squared length that divides."""
    steps: int = 5
    """Largest number of steps."""
    tolerance: float = 2e-11
    """Joint error at which a point is finished [rad]."""
    least_step: float = 1e-300
    """Smallest step length that divides [rad]."""
    second_order_ratio: float = 0.5
    """Ratio of the second-order term to the first below which it is added to the step."""
    chord_ratio: float = 0.1
    """Ratio below which the matrices of a step serve for another one."""
    many: int = 128
    """Number of points from which on they are solved together, faster than one by one in LAPACK."""


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
    if len(q) >= ACROSS.many:
        return _side_by_side(jacobian, along, error)
    sides = np.zeros((*q.shape, 2))
    sides[:, :-1, 0], sides[:, -1, 1] = error, 1.0
    found = np.asarray(np.linalg.solve(_system(jacobian, along), sides), dtype=float)
    return found[:, :, 0], found[:, :, 1]


def _side_by_side(jacobian: Array, along: Array, error: Array) -> tuple[Array, Array]:
    """The result of `step_across` from Jacobians (6, nq, n) and errors (n, 6), for all points
    together.

    The rows of the system are orthogonalised one after the other, together with the right-hand
    sides (modified Gram-Schmidt, which needs no pivoting). The last row, `along`, becomes a
    tangent.
    """
    count, nq, n = jacobian.shape
    rows = np.zeros((count + 1, nq + 1, n))
    rows[:-1, :-1], rows[:-1, -1], rows[-1, :-1] = jacobian, error.T, along.T
    for k in range(count + 1):
        row, rest = rows[k], rows[k + 1 :]
        side = row[:-1]
        # Divided by its squared length, a row times its right-hand side is its part of the step.
        scaled = side / np.maximum(np.einsum("jn,jn->n", side, side), ACROSS.least_square)
        if len(rest):
            rest -= np.einsum("ijn,jn->in", rest[:, :-1], scaled)[:, None] * row
        else:
            tangent = side.copy()
        side[:] = scaled
    return np.einsum("in,ijn->nj", rows[:, -1], rows[:, :-1]), tangent.T


def project_onto_curve(
    chain: Chain, q: Array, along: Array, ahead: Array, T: Array, longest: float = np.inf
) -> tuple[Array, Array]:
    """Projects configurations onto the self-motion of a flange pose, with a given displacement
    along a direction.

    Newton's method with a second-order term: with the ratio r of this term to the first-order step,
    the remaining error is about r² of the step. If r is small, the next step uses the same matrices
    (chord method) and leaves about 2 r of itself.

    Args:
        chain: chain of the arm.
        q: configurations, shape (n, nq) [rad].
        along: directions, shape (n, nq).
        ahead: displacements in these directions as scalar products, shape (n,).
        T: flange pose (4, 4).
        longest: largest joint movement of a step [rad].

    Returns:
        The configurations (n, nq) [rad], and estimates (n,) of the largest joint error left [rad].
    """
    q, ahead, left, rows = q.copy(), ahead.copy(), np.empty(len(q)), np.arange(len(q))
    for _ in range(ACROSS.steps):
        move, left[rows], ratio, inverse = _step(chain, q[rows], along[rows], ahead[rows], T)
        _advance(q, ahead, along, rows, np.minimum(np.maximum(move, -longest), longest))
        (again,) = ((left[rows] > ACROSS.tolerance) & (ratio < ACROSS.chord_ratio)).nonzero()
        if len(again):
            here, sides = rows[again], np.empty((len(again), q.shape[1]))
            sides[:, :-1] = sine_error(chain.flange_components(q[here]), T)
            sides[:, -1] = ahead[here]
            move = np.einsum("nij,nj->ni", inverse[again], sides)
            _advance(q, ahead, along, here, np.minimum(np.maximum(move, -longest), longest))
            left[here] = 2 * ratio[again] * np.maximum.reduce(np.abs(move), axis=1)
        (rows,) = (left > ACROSS.tolerance).nonzero()
        if not len(rows):
            break
    return q, left


def _advance(q: Array, ahead: Array, along: Array, rows: NDArray[np.intp], move: Array) -> None:
    """Moves rows (m,) of q by (m, nq), and reduces their remaining displacements `ahead` (n,), in
    place.
    """
    q[rows] += move
    ahead[rows] -= np.einsum("ij,ij->i", move, along[rows])


def _step(
    chain: Chain, q: Array, along: Array, ahead: Array, T: Array
) -> tuple[Array, Array, Array, Array]:
    """One step of `project_onto_curve`.

    Returns:
        The step (n, nq) [rad], the estimated error (n,) after it, the ratio (n,) of the
        second-order term to the first-order step, and the inverse matrices (n, nq, nq).
    """
    reached, jacobian = chain.flange_and_columns(q)
    inverse = np.asarray(np.linalg.inv(_system(jacobian, along)), dtype=float)
    sides = np.zeros(q.shape)
    sides[:, :-1], sides[:, -1] = sine_error(reached, T), ahead
    move: Array = np.einsum("nij,nj->ni", inverse, sides)
    more: Array = np.einsum("nij,jn->ni", inverse[:, :, :-1], second_order(jacobian, move.T))
    first, second = (np.maximum.reduce(np.abs(each), axis=1) for each in (move, more))
    first = np.maximum(first, ACROSS.least_step)
    ratio: Array = second / first
    small = ratio < ACROSS.second_order_ratio
    return (
        move - np.where(small[:, None], more, 0.0),
        np.where(small, ratio * second, first),
        ratio,
        inverse,
    )


def _system(jacobian: Array, along: Array) -> Array:
    """Matrices (n, nq, nq) of Jacobians (6, nq, n) above directions (n, nq), regularised."""
    n, nq = along.shape
    system = np.empty((n, nq, nq))
    system[:, :-1], system[:, -1] = jacobian.transpose(2, 0, 1), along
    system.reshape(n, -1)[:, :: nq + 1] += ACROSS.regularisation
    return system


def second_order(jacobian: Array, move: Array) -> Array:
    """Second-order part (6, n) [m, rad] of the flange motion along joint moves (nq, n) [rad].

    It comprises the position and the rotation vector, from the geometric Jacobian (6, nq, n). A
    joint turns everything behind it, including the motions by later joints: the second derivative
    of the position by joints i <= j is z_i × v_j, with the velocity v_j by joint j. The rotation
    vector has half the sum of z_i × z_j over i < j (Baker, Campbell, Hausdorff).
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


def project_across(chain: Chain, q: Array, along: Array, T: Array) -> Array:
    """Configurations (n, nq) [rad] of the self-motion of T (4, 4) next to q (n, nq), across `along`
    (n, nq).
    """
    return project_onto_curve(chain, q, along, np.zeros(len(q)), T)[0]


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
