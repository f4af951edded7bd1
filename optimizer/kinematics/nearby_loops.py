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
from optimizer.kinematics.across_curve import step_across
from optimizer.kinematics.angles import nearest_turn, wrapped
from optimizer.kinematics.chain import Chain
from optimizer.kinematics.curve_tracing import BENT, LONGEST, TracedPath, turns
from optimizer.kinematics.redundant_curve import CurveStack
from optimizer.kinematics.redundant_pose import RedundantPose

# steps along each curve of the arm nearby, twice as many once around, and starts on so many: two of these make a loop
STEPS, STARTS = 16, 4
# length [rad] of a step from which on a curve gets so many times the points, of which those are kept that are so far
# apart [rad]
UNEVEN, DENSER, EVEN = 0.6, 4, 0.3
# the last angle all around [rad]
WHOLE = (-np.pi, np.pi)
# distance [rad] of two ends of curves that are one point, and of a third that is not
JOINED, APART = 1e-4, 1e-2
# longest step of Newton's method [rad] that needs no other, and farthest way [rad] of a point to the curve
SHORT, MOVED = 0.01, 0.05


def loops(pose: RedundantPose, finer: int) -> tuple[list[Array], list[Array]]:
    """Points (m, 7) [rad] along loops of curves of a pose on the right shoulder, each from its first point once around,
    without full turns left out; and along curves that are in none, because more than two meet at an end, or one does.
    There are so many times more points if they are to be `finer`."""
    curves = right_curves(pose)
    if curves is None:
        return [], []
    points, ends = _points(curves, finer)
    found, rest = [points[k] for k in np.flatnonzero(curves.whole).tolist()], list[Array]()
    meets = _meeting(ends)
    left = np.flatnonzero(~curves.whole).tolist()
    while left:
        way, end = list[int](), 2 * left[0] + 1
        while end // 2 in left:
            left.remove(end // 2)
            way.append(end)
            end = meets[end] ^ 1 if meets[end] >= 0 else -1
        # the way ends where it began, at the other end of its first curve
        parts = [points[k // 2] if k % 2 else points[k // 2][::-1] for k in way]
        if end == way[0]:
            found.append(_joined(parts))
        else:
            rest += parts
    return found, rest


def spread_over(points: Array) -> Array:
    """Starts (n, nq) among the points (m, nq) along curves of the arm nearby."""
    count = STARTS * max(len(points) // STEPS, 1)
    return np.asarray(points[((np.arange(count) + 0.5) * len(points) / count).astype(int)])


def _points(curves: CurveStack, finer: int) -> tuple[list[Array], Array]:
    """Points (m, 7) [rad] along each of the curves from end to end, without full turns left out, and the configurations
    at the first and the last of them, (2n, 7)."""
    count = len(curves.whole)
    # a whole turn has twice the range
    steps = (2 if curves.whole.any() else 1) * STEPS * finer
    points = _along(curves, np.arange(count), steps)
    ends = points[:, [0, -1]].reshape(-1, 7)
    unwound, length = _unwound(points)
    found = list(unwound)
    uneven = np.flatnonzero(length.max(axis=1) > UNEVEN)
    if len(uneven):
        unwound, length = _unwound(_along(curves, uneven, DENSER * steps))
        # the first point after every EVEN, and both ends
        past = np.floor(np.cumsum(length, axis=1) * (finer / EVEN))
        kept = np.ones(unwound.shape[:2], dtype=bool)
        kept[:, 1:-1] = past[:, :-1] > np.hstack([np.zeros((len(uneven), 1)), past[:, :-2]])
        for k, each, chosen in zip(uneven.tolist(), unwound, kept, strict=True):
            found[k] = each[chosen]
    return found, ends


def _along(curves: CurveStack, rows: NDArray[np.intp], steps: int) -> Array:
    """Configurations (n, steps + 1, 7) [rad] along curves of rows (n,), from end to end."""
    share = np.arange(steps + 1) / steps
    u = np.where(curves.whole[rows, None], np.pi * (2 * share - 1), np.pi * share)
    each = np.repeat(rows, steps + 1)
    q7 = curves.last_angle(u.ravel(), each)
    return curves.pose.configurations(q7, curves.sheet[each]).reshape(len(rows), steps + 1, 7)


def _unwound(points: Array) -> tuple[Array, Array]:
    """Points (n, m, 7) [rad] along curves with the full turns that are left out between one and the next, and the
    lengths (n, m - 1) of the steps between."""
    steps = wrapped(points[:, 1:] - points[:, :-1])
    unwound = points.copy()
    np.cumsum(steps, axis=1, out=unwound[:, 1:])
    unwound[:, 1:] += points[:, :1]
    return unwound, np.sqrt((steps * steps).sum(axis=2))


def _joined(parts: Sequence[Array]) -> Array:
    """Points (m, 7) [rad] along a loop, of those along parts of which each ends where the next one begins."""
    found, end = [parts[0][:-1]], parts[0][-1]
    for each in parts[1:]:
        shift = nearest_turn(each[0], end) - each[0]
        found.append(each[:-1] + shift)
        end = each[-1] + shift
    return np.vstack([*found, end])


def right_curves(pose: RedundantPose) -> CurveStack | None:
    """The curves of a pose on the right shoulder; None if there are none."""
    each = [(interval, elbow) for elbow in (1.0, -1.0) for interval in pose.intervals(elbow) for _ in range(2)]
    if not each:
        return None
    interval = np.array([ends for ends, _ in each]).T
    sheet = np.array([[1.0, elbow, (1.0, -1.0)[k % 2]] for k, (_, elbow) in enumerate(each)])
    return CurveStack(pose, interval, np.array([ends == WHOLE for ends, _ in each]), sheet)


def _meeting(ends: Array) -> list[int]:
    """The end (n,) that each of ends (n, 7) [rad] meets, -1 if it meets none or several."""
    if len(ends) < 2:
        return [-1] * len(ends)
    away = np.abs(wrapped(ends[:, None] - ends)).max(axis=2)
    np.fill_diagonal(away, np.inf)
    alone = ((away < JOINED).sum(axis=1) == 1) & ((away < APART).sum(axis=1) == 1)
    met: list[int] = np.where(alone, away.argmin(axis=1), -1).tolist()
    return met


def followed(chain: Chain, loops: Sequence[Array], T: Array) -> tuple[list[TracedPath], Mask]:
    """The curves that hold the flange at T (4, 4) along loops (m, 7) [rad], and which of the loops (n,) have one."""
    if not loops:
        return [], np.zeros(0, dtype=bool)
    counts = [len(each) for each in loops]
    first = np.cumsum([0, *counts[:-1]])
    final = first + counts - 1
    points = np.vstack(loops)
    along = np.empty_like(points)
    along[1:-1] = points[2:] - points[:-2]
    along[first] = along[final] = points[first + 1] - points[first] + points[final] - points[final - 1]
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    q, tangent, moved = _onto(chain, points, along, T)
    # once around, a loop is where it began, but for full turns
    q[final], tangent[final] = q[first] + turns(points[final] - points[first]), tangent[first]
    steps = q[1:] - q[:-1]
    length = np.maximum(np.linalg.norm(steps, axis=1), 1e-300)
    cosine = np.minimum((tangent[1:] * tangent[:-1]).sum(axis=1), (tangent[1:] * steps).sum(axis=1) / length)
    fine = (length < 2 * LONGEST) & (cosine > BENT) & (moved[:-1] < MOVED)
    # from one loop to the next there is no step
    fine[final[:-1]] = True
    good = np.logical_and.reduceat(fine, first)
    parts = [slice(start, end + 1) for start, end in zip(first.tolist(), final.tolist(), strict=True)]
    kept = [part for part, each in zip(parts, good.tolist(), strict=True) if each]
    return [TracedPath(q[part], tangent[part], closed=True) for part in kept], np.asarray(good)


def _onto(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array, Array]:
    """Points near q (n, nq) [rad] of the curves that hold the flange at T (4, 4), unit tangents there, and how far
    [rad] they are (n,); from q across the directions `along` (n, nq)."""
    move, tangent = step_across(chain, q, along, T)
    reached = q + move
    moved = np.linalg.norm(move, axis=1)
    rows: NDArray[np.intp] = np.flatnonzero(moved > SHORT)
    if len(rows):
        again, tangent[rows] = step_across(chain, reached[rows], along[rows], T)
        reached[rows] += again
        moved[rows] = np.linalg.norm(reached[rows] - q[rows], axis=1)
    return reached, tangent / np.linalg.norm(tangent, axis=1)[:, None], moved
