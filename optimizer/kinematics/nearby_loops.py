"""The curves of an arm, all points at once, from those of an arm nearby whose closed form is known.

Where two branches meet, the curve over one goes on over the other: together they are loops. A step of Newton's method
leads points along a loop onto the curve of the arm itself. Next to a singularity that curve is another one: there the
step is long, or its tangents turn, and the loop is left to be followed point by point.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from models.robot import Array, Mask
from optimizer.kinematics.angles import wrapped
from optimizer.kinematics.chain import Chain, pose_error
from optimizer.kinematics.curve_tracing import ASIDE, BENT, LONGEST, TINY, TracedPath
from optimizer.kinematics.redundant_curve import RedundantCurve, members

# steps along each curve of the arm nearby, twice as many once around
STEPS = 32
# length [rad] of a step from which on a curve gets so many times the points, of which those are kept that are so far
# apart [rad]
UNEVEN, DENSER, EVEN = 0.6, 16, 0.25
# distance [rad] of two ends of curves that are one point, and of a third that is not
JOINED, APART = 1e-4, 1e-2
# longest step of Newton's method [rad] that needs no other
SHORT = 0.01


def loops(curves: Sequence[RedundantCurve]) -> tuple[list[Array], list[Array]]:
    """Points (m, 7) [rad] along loops of curves of one pose, each from its first point once around, without full turns
    left out; and points (n, 7) along curves that are in none, because more than two meet at an end, or one does."""
    points = _points(curves)
    whole = [k for k, each in enumerate(curves) if each.whole]
    found, rest = [points[k] for k in whole], list[Array]()
    ends = np.array([points[k // 2][-(k % 2)] for k in range(2 * len(points))]).reshape(-1, 7)
    meets = _meeting(ends)
    left = [k for k in range(len(curves)) if k not in whole]
    while left:
        way, end = list[int](), 2 * left[0] + 1
        while end // 2 in left:
            left.remove(end // 2)
            way.append(end)
            end = int(meets[end]) ^ 1 if meets[end] >= 0 else -1
        # the way ends where it began, at the other end of its first curve
        parts = [points[k // 2] if k % 2 else points[k // 2][::-1] for k in way]
        if end == way[0]:
            found.append(np.vstack([*(each[:-1] for each in parts), parts[0][:1]]))
        else:
            rest += parts
    return [np.unwrap(each, axis=0) for each in found], rest


def _points(curves: Sequence[RedundantCurve]) -> list[Array]:
    """Points (m, 7) [rad] along each of the curves from end to end."""
    if not curves:
        return []
    steps = [2 * STEPS if each.whole else STEPS for each in curves]
    points = members(curves, [np.linspace(*each.arcs[0], n + 1) for each, n in zip(curves, steps, strict=True)])
    uneven = [k for k, each in enumerate(points) if _lengths(each).max() > UNEVEN]
    if uneven:
        dense = [np.linspace(*curves[k].arcs[0], DENSER * steps[k] + 1) for k in uneven]
        for k, each in zip(uneven, members([curves[k] for k in uneven], dense), strict=True):
            # the first point after every EVEN
            past = np.floor(np.append(0.0, np.cumsum(_lengths(each))) / EVEN)
            points[k] = np.vstack([each[:1], each[1:-1][np.diff(past[:-1]) > 0], each[-1:]])
    return points


def _lengths(points: Array) -> Array:
    """Lengths (m - 1,) [rad] of the steps between points (m, 7)."""
    return np.asarray(np.linalg.norm(wrapped(np.diff(points, axis=0)), axis=1))


def _meeting(ends: Array) -> NDArray[np.intp]:
    """The end (n,) that each of ends (n, 7) [rad] meets, -1 if it meets none or several."""
    away = np.abs(wrapped(ends[:, None] - ends)).max(axis=2, initial=0.0)
    np.fill_diagonal(away, np.inf)
    alone = ((away < JOINED).sum(axis=1) == 1) & ((away < APART).sum(axis=1) == 1)
    return np.where(alone, away.argmin(axis=1), -1) if len(ends) > 1 else np.full(len(ends), -1)


def followed(chain: Chain, loops: Sequence[Array], T: Array) -> tuple[list[TracedPath], Mask]:
    """The curves that hold the flange at T (4, 4) along loops (m, 7) [rad], and which of the loops (n,) have one."""
    if not loops:
        return [], np.zeros(0, dtype=bool)
    starts = np.cumsum([0, *(len(each) - 1 for each in loops)])
    q = np.vstack([each[:-1] for each in loops])
    turn = np.array([each[-1] - each[0] for each in loops])
    ahead = np.vstack([each[1:] - each[:-1] for each in loops])
    before = np.vstack([np.roll(each[1:] - each[:-1], 1, axis=0) for each in loops])
    along = ahead + before
    q, tangent, moved = _onto(chain, q, along / np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None], T)
    paths, good = list[TracedPath](), np.zeros(len(loops), dtype=bool)
    for k in range(len(loops)):
        own = slice(starts[k], starts[k + 1])
        nodes, tangents = np.vstack([q[own], q[own][:1] + turn[k]]), np.vstack([tangent[own], tangent[own][:1]])
        steps = np.diff(nodes, axis=0)
        length = np.maximum(np.linalg.norm(steps, axis=1), 1e-300)
        cosine = np.minimum((tangents[1:] * tangents[:-1]).sum(axis=1), (tangents[1:] * steps).sum(axis=1) / length)
        good[k] = length.max() < 2 * LONGEST and cosine.min() > BENT and (moved[own] < ASIDE * length).all()
        if good[k]:
            paths.append(TracedPath(list(nodes), list(tangents), closed=True))
    return paths, good


def _onto(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array, Array]:
    """Points near q (n, nq) [rad] of the curves that hold the flange at T (4, 4), unit tangents there, and how far
    [rad] they are (n,); from q across the directions `along` (n, nq)."""
    first, tangent, rows = q, along.copy(), np.arange(len(q))
    q = q.copy()
    for _ in range(2):
        T_reached, jacobian = chain.flange_and_jacobian(q[rows])
        sides = np.zeros((len(rows), chain.nq, 2))
        sides[:, :-1, 0], sides[:, -1, 1] = pose_error(T_reached, T), 1.0
        system = np.concatenate([jacobian, along[rows, None]], axis=1) + TINY * np.eye(chain.nq)
        found = np.linalg.solve(system, sides)
        q[rows] += found[:, :, 0]
        tangent[rows] = found[:, :, 1] / np.linalg.norm(found[:, :, 1], axis=1)[:, None]
        rows = rows[np.linalg.norm(found[:, :, 0], axis=1) > SHORT]
        if not len(rows):
            break
    return q, tangent, np.asarray(np.linalg.norm(q - first, axis=1))
