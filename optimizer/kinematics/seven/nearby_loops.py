"""Self-motions of an arm, all points at once, from those of a nearby arm with a closed form.

Long or bent parts of these curves get more points: a curve with too few points would have to be
traced point by point. Where two branches meet, a curve continues on the other branch, so that
curves join to closed loops. A Newton step projects the points of a loop onto the curve of the arm
itself. Next to a singularity this curve is a different one: the step is then long, or the tangents
turn, and the loop is left for tracing point by point.
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
from joulepath.optimizer.kinematics.seven.curve_tracing import TRACING, turns
from joulepath.optimizer.kinematics.seven.redundant_curve import CurveStack
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.kinematics.seven.traced_curve_stack import TracedCurveStack


@dataclass(frozen=True)
class LoopSettings:
    """Settings of the points along loops and of their projection."""

    steps: int = 12
    """Number of initial steps along a curve, and half the number around a whole turn."""
    seeds: int = 3
    """Number of seeds for each `steps` points of a curve that is in no loop."""
    long_step: float = 0.75
    """Length above which a step is cut into several parts [rad]."""
    part: float = 0.4
    """Length of these parts [rad]."""
    most_parts: int = 16
    """Largest number of parts of a step."""
    most_bend: float = 0.35
    """Bend of the curve along a step above which the step is halved [rad]."""
    shortest_step: float = 0.03
    """Length below which a bent step is not halved [rad]."""
    rounds: int = 5
    """Largest number of rounds of cutting."""
    kept_spacing: float = 0.6
    """Largest distance of kept points along a curve [rad]."""
    kept_bend: float = 0.4
    """Largest bend of a curve between kept points [rad]."""
    least_cosine: float = 0.8
    """Smallest cosine between the tangents at both ends of a step, and between tangent and step."""
    joined: float = 1e-4
    """Largest joint distance of two ends of curves that meet [rad]."""
    apart: float = 1e-2
    """Smallest joint distance of any third end from them [rad]."""
    least_square: float = 1e-20
    """Product of two lengths below which a step has no direction [rad²]."""
    short_newton_step: float = 0.01
    """Longest Newton step that needs no second one [rad]."""
    farthest_projection: float = 0.05
    """Largest distance of a point from its projection [rad]."""
    cached_kinds: int = 64
    """Number of cached parameter grids, one for each combination of whole turns."""


SETTINGS = LoopSettings()


@dataclass(frozen=True, eq=False)
class Loops:
    """Points (m, nq) [rad] along closed curves, one curve after the other.

    `counts` are the numbers of points of each curve, once around, with the first point repeated at
    the end and without jumps by full turns. The step from one curve to the next is arbitrary.
    """

    points: Array
    counts: list[int]

    def each(self) -> list[Array]:
        """Points of each closed curve."""
        return np.split(self.points, np.cumsum(self.counts)[:-1]) if self.counts else []


def loops(pose: RedundantPose) -> tuple[Loops, list[Array]]:
    """Closed curves of a pose on the right shoulder.

    Returns:
        The closed curves, and points (m, 7) [rad] along each curve that is in none, because its
        ends meet several ends or none.
    """
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
        path, end = list[int](), 2 * left[0] + 1
        while end // 2 in left:
            left.remove(end // 2)
            path.append(end)
            end = meets[end] ^ 1 if meets[end] >= 0 else -1
        parts = [range(bounds[k // 2], bounds[k // 2 + 1])[:: 1 if k % 2 else -1] for k in path]
        # The path is closed if it returns to the other end of its first curve.
        if end == path[0]:
            # Each part ends at the first point of the next one.
            before, total = [k for part in parts[:-1] for k in part[:-1]], len(order)
            order += [*before, *parts[-1]]
            counts.append(len(order) - total)
        else:
            rest += [q[part] for part in parts]
    points = q[order]
    points[1:] -= np.cumsum(turns(points[1:] - points[:-1]), axis=0)
    return Loops(points, counts), rest


def seeds_along(points: Array) -> Array:
    """Seeds (n, nq), evenly chosen from points (m, nq) along curves of the nearby arm."""
    count = SETTINGS.seeds * max(len(points) // SETTINGS.steps, 1)
    return np.asarray(points[((np.arange(count) + 0.5) * len(points) / count).astype(int)])


@lru_cache(SETTINGS.cached_kinds)
def _grid(whole: tuple[bool, ...]) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Parameter grid of curves with given whole turns (n,).

    Returns:
        The parameters (m,), the curve (m,) of each, and the rows (2n,) of the first and the last
        point of every curve.
    """
    # A whole turn has twice the range of parameters.
    counts = np.where(whole, 2 * SETTINGS.steps, SETTINGS.steps)
    rows = np.repeat(np.arange(len(counts)), counts + 1)
    last = np.cumsum(counts + 1) - 1
    share = (np.arange(len(rows)) - (last - counts)[rows]) / counts[rows]
    u = np.pi * np.where(np.array(whole)[rows], 2 * share - 1, share)
    return u, rows, np.array([last - counts, last]).T.ravel()


def _points(curves: CurveStack) -> tuple[Array, list[int], Array]:
    """Points along curves from end to end, one curve after the other.

    Returns:
        The points (m, 7) [rad]; the first row of each curve, and m; and the configurations (2n, 7)
        at the first and the last point of each curve.
    """
    u, rows, outer = _grid(tuple(curves.whole.tolist()))
    q = _at(curves, u, rows)
    ends = q[outer]
    for _ in range(SETTINGS.rounds):
        length, bend = _steps(q, rows)
        parts = _parts(length, bend)
        cut = np.flatnonzero(parts > 1)
        if not len(cut):
            break
        # Points to insert into each cut step.
        more = parts[cut] - 1
        before, total = cut.repeat(more), np.cumsum(more)
        nth = np.arange(1, len(before) + 1) - (total - more).repeat(more)
        between = u[before] + nth / parts[before] * (u[before + 1] - u[before])
        # Source of each point: existing points first, then the inserted ones.
        place = np.concatenate([np.arange(len(q)), before]).argsort(kind="stable")
        q = np.concatenate([q, _at(curves, between, rows[before])])[place]
        u, rows = np.concatenate([u, between])[place], np.concatenate([rows, rows[before]])[place]
    else:
        length, bend = _steps(q, rows)
    kept = _kept(length, bend, rows)
    rows = rows[kept]
    return q[kept], [0, *(np.flatnonzero(rows[1:] != rows[:-1]) + 1).tolist(), len(kept)], ends


def _at(curves: CurveStack, u: Array, rows: NDArray[np.intp]) -> Array:
    """Configurations (n, 7) [rad] at parameters u (n,) of the curves in rows (n,)."""
    return curves.pose.configurations(curves.last_angle(u, rows), curves.signs[rows])


def _steps(q: Array, rows: NDArray[np.intp]) -> tuple[Array, Array]:
    """Lengths and bends of the steps between consecutive points.

    Args:
        q: points, shape (n, 7) [rad].
        rows: curve of each point, shape (n,).

    Returns:
        The lengths (n - 1,) [rad], 0 from one curve to the next, and the approximate bends (n - 1,)
        [rad].
    """
    steps = wrapped(q[1:] - q[:-1])
    length = np.sqrt(np.einsum("ij,ij->i", steps, steps))
    other = np.flatnonzero(rows[1:] != rows[:-1])
    length[other] = 0.0
    product = length[1:] * length[:-1]
    cosine = np.einsum("ij,ij->i", steps[1:], steps[:-1]) / np.maximum(
        product, SETTINGS.least_square
    )
    turn = np.zeros(len(q))
    turn[1:-1] = np.where(
        product > SETTINGS.least_square, np.sqrt(np.maximum(2 - 2 * cosine, 0.0)), 0.0
    )
    # At its ends a curve continues on another one, and bends there as at the adjacent points.
    turn[0], turn[-1], turn[other], turn[other + 1] = (
        turn[1],
        turn[-2],
        turn[other - 1],
        turn[other + 2],
    )
    return length, (turn[1:] + turn[:-1]) / 2


def _parts(length: Array, bend: Array) -> NDArray[np.intp]:
    """Number (n,) of parts of each step, from its length (n,) and bend (n,) [rad]."""
    long = np.minimum(np.ceil(length / SETTINGS.part), SETTINGS.most_parts)
    return np.where(
        length > SETTINGS.long_step,
        long,
        np.where((bend > SETTINGS.most_bend) & (length > SETTINGS.shortest_step), 2, 1),
    ).astype(np.intp)


def _kept(length: Array, bend: Array, rows: NDArray[np.intp]) -> list[int]:
    """Indices of sufficient points of curves (n,), including both ends of each curve."""
    starts = [True, *(rows[1:] != rows[:-1]).tolist(), True]
    found, distance, turned = list[int](), 0.0, 0.0
    # A loop over floats, because every choice depends on the previous one.
    for k, (step, turn) in enumerate(
        zip([*length.tolist(), 0.0], [*bend.tolist(), 0.0], strict=True)
    ):
        if (
            starts[k]
            or starts[k + 1]
            or distance + step > SETTINGS.kept_spacing
            or turned + turn > SETTINGS.kept_bend
        ):
            found.append(k)
            distance = turned = 0.0
        distance, turned = distance + step, turned + turn
    return found


def right_curves(pose: RedundantPose) -> CurveStack | None:
    """Curves of a pose on the right shoulder; None if there are none."""
    each = [
        (interval, elbow)
        for elbow in (1.0, -1.0)
        for interval in pose.intervals(elbow)
        for _ in range(2)
    ]
    if not each:
        return None
    interval = np.array([ends for ends, _ in each]).T
    signs = np.array([[1.0, elbow, (1.0, -1.0)[k % 2]] for k, (_, elbow) in enumerate(each)])
    return CurveStack(
        pose, interval, np.array([ends == (-np.pi, np.pi) for ends, _ in each]), signs
    )


def _meeting(ends: Array) -> list[int]:
    """Partner (n,) of each of the ends (n, 7) [rad] of curves; -1 if an end meets none or
    several.
    """
    if len(ends) < 2:
        return [-1] * len(ends)
    away = np.abs(wrapped(ends[:, None] - ends)).max(axis=2)
    np.fill_diagonal(away, np.inf)
    alone = ((away < SETTINGS.joined).sum(axis=1) == 1) & ((away < SETTINGS.apart).sum(axis=1) == 1)
    met: list[int] = np.where(alone, away.argmin(axis=1), -1).tolist()
    return met


def project_loops(chain: Chain, loops: Loops, T: Array) -> tuple[TracedCurveStack, Mask]:
    """Projects loops onto the self-motions of the flange pose T (4, 4).

    Returns:
        The curves, and a mask (n,) of the successfully projected loops.
    """
    if not loops.counts:
        return TracedCurveStack.of([]), np.zeros(0, dtype=bool)
    points = loops.points
    end: NDArray[np.intp] = np.cumsum(loops.counts, dtype=np.intp)
    first, final = end - loops.counts, end - 1
    along = np.empty_like(points)
    along[1:-1] = points[2:] - points[:-2]
    along[first] = along[final] = (
        points[first + 1] - points[first] + points[final] - points[final - 1]
    )
    q, tangent, moved = _project(chain, points, along, T)
    # Once around, a loop returns to its start up to full turns.
    q[final], tangent[final] = q[first] + turns(points[final] - points[first]), tangent[first]
    steps = q[1:] - q[:-1]
    length = np.sqrt(np.einsum("ij,ij->i", steps, steps))
    turned = np.einsum("ij,ij->i", tangent[1:], tangent[:-1])
    ahead = np.einsum("ij,ij->i", tangent[1:], steps)
    fine = (
        (length < 2 * TRACING.longest_step)
        & (turned > SETTINGS.least_cosine)
        & (ahead > SETTINGS.least_cosine * length)
        & (moved[:-1] < SETTINGS.farthest_projection)
    )
    # There is no step from one loop to the next.
    fine[final[:-1]] = True
    good = np.logical_and.reduceat(fine, first)
    if not good.all():
        kept, counts = np.repeat(good, loops.counts), np.array(loops.counts, dtype=np.intp)[good]
        q, tangent, first = q[kept], tangent[kept], np.cumsum(counts) - counts
    return TracedCurveStack(q, tangent, first, np.full(int(good.sum()), np.pi)), np.asarray(good)


def _project(chain: Chain, q: Array, along: Array, T: Array) -> tuple[Array, Array, Array]:
    """Projects points q (n, nq) [rad] onto the self-motions of the flange pose T (4, 4), across
    directions `along` (n, nq).

    Returns:
        The projections (n, nq) [rad], unit tangents (n, nq), and distances (n,) [rad].
    """
    move, tangent = step_across(chain, q, along, T)
    reached = q + move
    moved = np.sqrt(np.einsum("ij,ij->i", move, move))
    rows: NDArray[np.intp] = np.flatnonzero(moved > SETTINGS.short_newton_step)
    if len(rows):
        again, tangent[rows] = step_across(chain, reached[rows], along[rows], T)
        reached[rows] += again
        moved[rows] = np.linalg.norm(reached[rows] - q[rows], axis=1)
    squares = np.maximum(np.einsum("ij,ij->i", tangent, tangent), SETTINGS.least_square)
    return reached, tangent / np.sqrt(squares)[:, None], moved
