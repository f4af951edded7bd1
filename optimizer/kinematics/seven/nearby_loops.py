"""The curves of an arm, all points at once, from those of an arm nearby whose closed form is known.

Where these are long or bend, they get more points: a curve with too few would have to be followed
point by point. Where two branches meet, the curve over one goes on over the other: together they
are loops. A step of Newton's method leads points along a loop onto the curve of the arm itself.
Next to a singularity that curve is another one: there the step is long, or its tangents turn, and
the loop is left to be followed point by point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.seven.across_curve import step_across
from joulepath.optimizer.kinematics.seven.curve_tracing import LONGEST, turns
from joulepath.optimizer.kinematics.seven.redundant_curve import CurveStack
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.kinematics.seven.traced_stack import TracedStack

# steps along each curve of the arm nearby, twice as many once around, and starts on so many: two of
# these make a loop
STEPS, STARTS = 12, 3
# a step that is longer [rad] is cut into parts that long, so many at most; one along which the
# curve bends by more than BENT_BY [rad], into two, if it is not shorter than LEAST [rad]; so many
# times over
LONG, PART, MOST_PARTS, BENT_BY, LEAST, ROUNDS = 0.75, 0.4, 16, 0.35, 0.03, 5
# farthest points that are kept along a curve [rad], and most that it bends between them [rad]
SPACED, TURNED = 0.6, 0.4
# least cosine of tangents at both ends of a step, and of those with it
BENT = 0.8
# the last angle all around [rad]
WHOLE = (-np.pi, np.pi)
# distance [rad] of two ends of curves that are one point, and of a third that is not
JOINED, APART = 1e-4, 1e-2
# product of lengths [rad²] of which one is none
NONE = 1e-20
# longest step of Newton's method [rad] that needs no other, and farthest way [rad] of a point to
# the curve
SHORT, MOVED = 0.01, 0.05
# kinds of curves of a pose, whole or not, whose parameters are kept
MOST_KINDS = 64


@dataclass(frozen=True, eq=False)
class Loops:
    """Points (m, nq) [rad] along loops, one loop after the other; each has so many, from its first
    once around, without full turns left out. From one loop to the next there may be any."""

    points: Array
    counts: list[int]

    def each(self) -> list[Array]:
        """The points of each loop."""
        return np.split(self.points, np.cumsum(self.counts)[:-1]) if self.counts else []


def loops(pose: RedundantPose) -> tuple[Loops, list[Array]]:
    """Loops of curves of a pose on the right shoulder; and points (m, 7) [rad] along curves that
    are in none, since more than two meet at an end, or only one."""
    curves = right_curves(pose)
    if curves is None:
        return Loops(np.zeros((0, 7)), []), []
    q, bounds, ends = _points(curves)
    order, counts, rest = list[int](), list[int](), list[Array]()
    for k in np.flatnonzero(curves.whole).tolist():
        order += range(bounds[k], bounds[k + 1])
        counts.append(bounds[k + 1] - bounds[k])
    meets, left = _meeting(ends), np.flatnonzero(~curves.whole).tolist()
    while left:
        way, end = list[int](), 2 * left[0] + 1
        while end // 2 in left:
            left.remove(end // 2)
            way.append(end)
            end = meets[end] ^ 1 if meets[end] >= 0 else -1
        parts = [range(bounds[k // 2], bounds[k // 2 + 1])[:: 1 if k % 2 else -1] for k in way]
        # the way ends where it began, at the other end of its first curve
        if end == way[0]:
            # each part ends where the next one begins
            before, total = [k for part in parts[:-1] for k in part[:-1]], len(order)
            order += [*before, *parts[-1]]
            counts.append(len(order) - total)
        else:
            rest += [q[part] for part in parts]
    points = q[order]
    points[1:] -= np.cumsum(turns(points[1:] - points[:-1]), axis=0)
    return Loops(points, counts), rest


def spread_over(points: Array) -> Array:
    """Starts (n, nq) among the points (m, nq) along curves of the arm nearby."""
    count = STARTS * max(len(points) // STEPS, 1)
    return np.asarray(points[((np.arange(count) + 0.5) * len(points) / count).astype(int)])


@lru_cache(MOST_KINDS)
def _grid(whole: tuple[bool, ...]) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Parameters (m,) along curves, which are whole or not (n,), the curve (m,) of each, and the
    rows (2n,) of the first and of the last one of every curve."""
    # a whole turn has twice the range
    counts = np.where(whole, 2 * STEPS, STEPS)
    rows = np.repeat(np.arange(len(counts)), counts + 1)
    last = np.cumsum(counts + 1) - 1
    share = (np.arange(len(rows)) - (last - counts)[rows]) / counts[rows]
    u = np.pi * np.where(np.array(whole)[rows], 2 * share - 1, share)
    return u, rows, np.array([last - counts, last]).T.ravel()


def _points(curves: CurveStack) -> tuple[Array, list[int], Array]:
    """Points (m, 7) [rad] along the curves from end to end, one curve after the other; where each
    of them begins, and m; and the configurations at the first and the last point of each, (2n, 7).
    """
    u, rows, outer = _grid(tuple(curves.whole.tolist()))
    q = _at(curves, u, rows)
    ends = q[outer]
    for _ in range(ROUNDS):
        length, bend = _steps(q, rows)
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
        length, bend = _steps(q, rows)
    kept = _kept(length, bend, rows)
    rows = rows[kept]
    return q[kept], [0, *(np.flatnonzero(rows[1:] != rows[:-1]) + 1).tolist(), len(kept)], ends


def _at(curves: CurveStack, u: Array, rows: NDArray[np.intp]) -> Array:
    """Configurations (n, 7) [rad] at parameters u (n,) of curves (n,)."""
    return curves.pose.configurations(curves.last_angle(u, rows), curves.sheet[rows])


def _steps(q: Array, rows: NDArray[np.intp]) -> tuple[Array, Array]:
    """The lengths [rad] (n - 1,) of the steps from each of the points q (n, 7) of curves (n,) to
    the next, 0 from one curve to another, and by how much [rad] the curves bend along them (n -
    1,), nearly."""
    steps = wrapped(q[1:] - q[:-1])
    length = np.sqrt(np.einsum("ij,ij->i", steps, steps))
    other = np.flatnonzero(rows[1:] != rows[:-1])
    length[other] = 0.0
    product = length[1:] * length[:-1]
    cosine = np.einsum("ij,ij->i", steps[1:], steps[:-1]) / np.maximum(product, NONE)
    turn = np.zeros(len(q))
    turn[1:-1] = np.where(product > NONE, np.sqrt(np.maximum(2 - 2 * cosine, 0.0)), 0.0)
    # at its ends, a curve goes on along another one, and bends as it does next to them
    turn[0], turn[-1], turn[other], turn[other + 1] = (
        turn[1],
        turn[-2],
        turn[other - 1],
        turn[other + 2],
    )
    return length, (turn[1:] + turn[:-1]) / 2


def _parts(length: Array, bend: Array) -> NDArray[np.intp]:
    """How many parts each step of a length (n,) along which the curve bends (n,) [rad] is to be cut
    into.
    """
    long = np.minimum(np.ceil(length / PART), MOST_PARTS)
    return np.where(
        length > LONG, long, np.where((bend > BENT_BY) & (length > LEAST), 2, 1)
    ).astype(np.intp)


def _kept(length: Array, bend: Array, rows: NDArray[np.intp]) -> list[int]:
    """Indices of the points of curves (n,) that are enough, both ends of each curve among them."""
    starts = [True, *(rows[1:] != rows[:-1]).tolist(), True]
    found, way, turned = list[int](), 0.0, 0.0
    # plain numbers: every choice depends on the one before
    for k, (step, turn) in enumerate(
        zip([*length.tolist(), 0.0], [*bend.tolist(), 0.0], strict=True)
    ):
        if starts[k] or starts[k + 1] or way + step > SPACED or turned + turn > TURNED:
            found.append(k)
            way = turned = 0.0
        way, turned = way + step, turned + turn
    return found


def right_curves(pose: RedundantPose) -> CurveStack | None:
    """The curves of a pose on the right shoulder; None if there are none."""
    each = [
        (interval, elbow)
        for elbow in (1.0, -1.0)
        for interval in pose.intervals(elbow)
        for _ in range(2)
    ]
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


def followed(chain: Chain, loops: Loops, T: Array) -> tuple[TracedStack, Mask]:
    """The curves that hold the flange at T (4, 4) along loops, and which of the loops (n,) have
    one.
    """
    if not loops.counts:
        return TracedStack.of([]), np.zeros(0, dtype=bool)
    points = loops.points
    end: NDArray[np.intp] = np.cumsum(loops.counts, dtype=np.intp)
    first, final = end - loops.counts, end - 1
    along = np.empty_like(points)
    along[1:-1] = points[2:] - points[:-2]
    along[first] = along[final] = (
        points[first + 1] - points[first] + points[final] - points[final - 1]
    )
    q, tangent, moved = _onto(chain, points, along, T)
    # once around, a loop is where it began, but for full turns
    q[final], tangent[final] = q[first] + turns(points[final] - points[first]), tangent[first]
    steps = q[1:] - q[:-1]
    length = np.sqrt(np.einsum("ij,ij->i", steps, steps))
    turned = np.einsum("ij,ij->i", tangent[1:], tangent[:-1])
    ahead = np.einsum("ij,ij->i", tangent[1:], steps)
    fine = (length < 2 * LONGEST) & (turned > BENT) & (ahead > BENT * length) & (moved[:-1] < MOVED)
    # from one loop to the next there is no step
    fine[final[:-1]] = True
    good = np.logical_and.reduceat(fine, first)
    if not good.all():
        kept, counts = np.repeat(good, loops.counts), np.array(loops.counts, dtype=np.intp)[good]
        q, tangent, first = q[kept], tangent[kept], np.cumsum(counts) - counts
    return TracedStack(q, tangent, first, np.full(int(good.sum()), np.pi)), np.asarray(good)


def _onto(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array, Array]:
    """Points near q (n, nq) [rad] of the curves that hold the flange at T (4, 4), unit tangents
    there, and how far [rad] they are (n,); from q across the directions `along` (n, nq)."""
    move, tangent = step_across(chain, q, along, T)
    reached = q + move
    moved = np.sqrt(np.einsum("ij,ij->i", move, move))
    rows: NDArray[np.intp] = np.flatnonzero(moved > SHORT)
    if len(rows):
        again, tangent[rows] = step_across(chain, reached[rows], along[rows], T)
        reached[rows] += again
        moved[rows] = np.linalg.norm(reached[rows] - q[rows], axis=1)
    squares = np.maximum(np.einsum("ij,ij->i", tangent, tangent), NONE)
    return reached, tangent / np.sqrt(squares)[:, None], moved
