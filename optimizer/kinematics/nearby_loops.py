"""The curves of an arm, all points at once, from those of an arm nearby whose closed form is known.

Where these are long or bend, they get more points: a curve with too few would have to be followed point by point.
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
# a step that is longer [rad] is cut into parts that long, so many at most; one along which the curve bends by more than
# BENT_BY [rad], into two, if it is not shorter than LEAST [rad]; so many times over
LONG, PART, MOST_PARTS, BENT_BY, LEAST, ROUNDS = 0.6, 0.25, 16, 0.35, 0.03, 5
# farthest points that are kept along a curve [rad], and most that it bends between them [rad]
SPACED, TURNED = 0.45, 0.4
# the last angle all around [rad]
WHOLE = (-np.pi, np.pi)
# distance [rad] of two ends of curves that are one point, and of a third that is not
JOINED, APART = 1e-4, 1e-2
# product of lengths of steps [rad²] of which one is none
NONE = 1e-20
# longest step of Newton's method [rad] that needs no other, and farthest way [rad] of a point to the curve
SHORT, MOVED = 0.01, 0.05


def loops(pose: RedundantPose) -> tuple[list[Array], list[Array]]:
    """Points (m, 7) [rad] along loops of curves of a pose on the right shoulder, each from its first point once around,
    without full turns left out; and along curves that are in none, since more than two meet at an end, or only one."""
    curves = right_curves(pose)
    if curves is None:
        return [], []
    points, ends = _points(curves)
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


def _points(curves: CurveStack) -> tuple[list[Array], Array]:
    """Points (m, 7) [rad] along each of the curves from end to end, without full turns left out, and the configurations
    at the first and the last of them, (2n, 7)."""
    # a whole turn has twice the range
    counts = np.where(curves.whole, 2 * STEPS, STEPS)
    rows = np.repeat(np.arange(len(counts)), counts + 1)
    last = np.cumsum(counts + 1) - 1
    share = (np.arange(len(rows)) - (last - counts)[rows]) / counts[rows]
    u = np.pi * np.where(curves.whole[rows], 2 * share - 1, share)
    q = _at(curves, u, rows)
    ends = q[np.array([last - counts, last]).T.ravel()]
    for _ in range(ROUNDS):
        steps, length, bend = _steps(q, rows)
        parts = _parts(length, bend)
        cut = np.flatnonzero(parts > 1)
        if not len(cut):
            break
        # the points between those of each cut step
        more = parts[cut] - 1
        before, total = cut.repeat(more), np.cumsum(more)
        nth = np.arange(1, len(before) + 1) - (total - more).repeat(more)
        between = u[before] + nth / parts[before] * (u[before + 1] - u[before])
        # where each point comes from: those of before first, then those between
        place = np.concatenate([np.arange(len(q)), before]).argsort(kind="stable")
        q = np.concatenate([q, _at(curves, between, rows[before])])[place]
        u, rows = np.concatenate([u, between])[place], np.concatenate([rows, rows[before]])[place]
    else:
        steps, length, bend = _steps(q, rows)
    kept = _kept(length, bend, rows)
    unwound = np.cumsum(np.vstack([q[:1], steps]), axis=0)[kept]
    return np.split(unwound, np.flatnonzero(np.diff(rows[kept])) + 1), ends


def _at(curves: CurveStack, u: Array, rows: NDArray[np.intp]) -> Array:
    """Configurations (n, 7) [rad] at parameters u (n,) of curves (n,)."""
    return curves.pose.configurations(curves.last_angle(u, rows), curves.sheet[rows])


def _steps(q: Array, rows: NDArray[np.intp]) -> tuple[Array, Array, Array]:
    """The steps (n - 1, 7) [rad] from each of the points q (n, 7) of curves (n,) to the next, their lengths (n - 1,), 0
    from one curve to another, and by how much [rad] the curves bend along them (n - 1,), nearly."""
    steps = wrapped(q[1:] - q[:-1])
    length = np.sqrt((steps * steps).sum(axis=1))
    length[rows[1:] != rows[:-1]] = 0.0
    product = length[1:] * length[:-1]
    cosine = (steps[1:] * steps[:-1]).sum(axis=1) / np.maximum(product, NONE)
    turn = np.zeros(len(q))
    turn[1:-1] = np.where(product > NONE, np.sqrt(np.maximum(2 - 2 * cosine, 0.0)), 0.0)
    # at its ends, a curve goes on along another one, and bends as it does next to them
    last = np.append(np.flatnonzero(rows[1:] != rows[:-1]), len(q) - 1)
    first = np.append(0, last[:-1] + 1)
    turn[last], turn[first] = turn[last - 1], turn[first + 1]
    return steps, length, (turn[1:] + turn[:-1]) / 2


def _parts(length: Array, bend: Array) -> NDArray[np.intp]:
    """How many parts each step of a length (n,) along which the curve bends (n,) [rad] is to be cut into."""
    long = np.minimum(np.ceil(length / PART), MOST_PARTS)
    return np.where(length > LONG, long, np.where((bend > BENT_BY) & (length > LEAST), 2, 1)).astype(np.intp)


def _kept(length: Array, bend: Array, rows: NDArray[np.intp]) -> list[int]:
    """Indices of the points of curves (n,) that are enough, both ends of each curve among them."""
    starts = [True, *(rows[1:] != rows[:-1]).tolist(), True]
    found, way, turned = list[int](), 0.0, 0.0
    # plain numbers: every choice depends on the one before
    for k, (step, turn) in enumerate(zip([*length.tolist(), 0.0], [*bend.tolist(), 0.0], strict=True)):
        if starts[k] or starts[k + 1] or way + step > SPACED or turned + turn > TURNED:
            found.append(k)
            way = turned = 0.0
        way, turned = way + step, turned + turn
    return found


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
