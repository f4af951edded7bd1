"""Cycles of a log with a repeated motion.

Rests, clocks and speed overrides change the duration of a cycle, but not its path. The path is
therefore compared with itself over its own length: a log repeats with a period if its path, shifted
by this length, coincides with itself for at least a whole period.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import Indices


@dataclass(frozen=True)
class CycleSettings:
    """Settings of the search for cycles."""

    spacing: float = 0.02
    """Distance of the points of a path [rad]."""
    max_points: int = 50_000
    """Largest number of points, whose distance then grows."""
    position_tolerance: float = 0.05
    """Largest distance of a joint between equal positions [rad], as of equal moves."""
    least_speed: float = 0.05
    """Speed up to which motion may be noise, over the 95th percentile of the speed [1]."""
    least_extent: float = 0.2
    """Smallest range of some joint in a cycle [rad]: smaller motions are close to themselves."""
    slack: float = 0.02
    """Difference of the lengths of two cycles, over their length [1]."""
    compared_points: int = 4000
    """Largest number of points at which the shifted path is compared."""
    least_share: float = 0.5
    """Smallest share of the path that the cycles cover [1]; the middle of the path is in them."""
    max_periods: int = 200
    """Largest number of periods that are tried, from the shortest on."""


CYCLES = CycleSettings()


def cycle_edges(q: Array, v: Array, rest: Mask, rate: float, segments: list[int]) -> Indices:
    """Find the cycles of a log.

    Args:
        q: positions (n, nq) [rad].
        v: velocities (n, nq) [rad/s].
        rest: whether the arm rests (n,).
        rate: rate of the rows [Hz].
        segments: first rows of moves and rests, and the last row. Cycles begin at these rows if
            the arm rests between the cycles.

    Returns:
        First row of every cycle, and the end of the last cycle; empty without cycles.
    """
    speed = np.sqrt(np.einsum("ij,ij->i", v, v, dtype=float))
    moving = ~rest & (speed > CYCLES.least_speed * np.percentile(speed, 95))
    if not moving.any():
        return np.zeros(0, dtype=int)
    length = np.cumsum(np.where(moving, speed, 0.0)) / rate
    spacing = max(CYCLES.spacing, float(length[-1]) / CYCLES.max_points)
    points = np.arange(0.0, float(length[-1]), spacing)
    row = np.searchsorted(length, points, side="right")
    path = q[row].astype(float)
    found = _repetition(path)
    if found is None:
        return np.zeros(0, dtype=int)
    first, last, period = found
    begins = np.array([each for each in segments if not rest[each]], dtype=int)
    at = length[begins] / spacing
    inside = np.flatnonzero((at >= first - _slack(0)) & (at <= last - 2 * period + _slack(period)))
    anchor = round(float(at[inside[0]])) if inside.size else first
    edges = _recurrences(path, min(max(anchor, 0), len(path) - 1), period, last)
    if len(edges) < 3:
        return np.zeros(0, dtype=int)
    return _at_segments(np.array(edges), row, length / spacing, rest, np.array(segments))


def _slack(period: int) -> int:
    """Tolerance of a recurrence in points, for a period in points."""
    return 2 + int(np.ceil(CYCLES.slack * period))


def _distance(path: Array, one: Indices, other: Indices | int) -> Array:
    """Largest distance of a joint between points of the path [rad]."""
    return np.asarray(np.abs(path[one] - path[other]).max(axis=-1))


def _repetition(path: Array) -> tuple[int, int, int] | None:
    """First and last point of the repeating part of a path (n, nq), and its period in points."""
    for period in _possible_periods(path):
        part = _repeating_part(path, period)
        if part is not None:
            return (*part, period)
    return None


def _possible_periods(path: Array) -> Iterator[int]:
    """Distances of the middle of the path from its recurrences, in points, the shortest first."""
    middle, every = len(path) // 2, np.arange(len(path))
    distance = _distance(path, every, middle)
    near = np.flatnonzero(distance < CYCLES.position_tolerance)
    runs = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1)
    nearest = [int(run[np.argmin(distance[run])]) for run in runs if run.size]
    periods = sorted({abs(each - middle) for each in nearest} - {0})
    yield from periods[: CYCLES.max_periods]


def _repeating_part(path: Array, period: int) -> tuple[int, int] | None:
    """Find the part around the middle of the path with a given period.

    Args:
        path: path, shape (n, nq) [rad].
        period: period in points.

    Returns:
        First and last point; None if the part is shorter than two periods or too small a share of
        the path.
    """
    count, slack = len(path) - period, _slack(period)
    stride = max(1, count // CYCLES.compared_points)
    points = np.arange(0, count, stride)
    nearest = np.full(len(points), np.inf)
    for shift in range(-slack, slack + 1):
        other = np.clip(points + period + shift, 0, len(path) - 1)
        nearest = np.minimum(nearest, _distance(path, points, other))
    differ = points[nearest >= CYCLES.position_tolerance]
    for inside in (len(path) // 2, len(path) // 2 - period):
        before, after = differ[differ <= inside], differ[differ > inside]
        first = int(before[-1]) + stride if before.size else 0
        end = int(after[0]) if after.size else count
        last = end + period
        enough = end - first >= period - slack and last - first >= CYCLES.least_share * len(path)
        if first <= inside and enough:
            extent = np.ptp(path[first : first + period], axis=0).max(initial=0.0)
            return (first, min(last, len(path)) - 1) if extent > CYCLES.least_extent else None
    return None


def _recurrences(path: Array, anchor: int, period: int, last: int) -> list[int]:
    """Recurrences of the path at an anchor, about one period apart.

    Args:
        path: path, shape (n, nq) [rad].
        anchor: point to return to.
        period: period in points.
        last: last point of the repeating part.
    """
    found, slack = [anchor], _slack(period)
    while found[-1] + period <= last + slack:
        near = np.arange(found[-1] + period - slack, found[-1] + period + slack + 1)
        near = near[near < len(path)]
        distance = _distance(path, near, anchor)
        best = int(np.argmin(distance))
        if distance[best] >= CYCLES.position_tolerance:
            break
        found.append(int(near[best]))
    return found


def _at_segments(
    edges: Indices, row: Indices, place: Array, rest: Mask, segments: Indices
) -> Indices:
    """Move the edges of cycles to the starts of motions or else of rests close to them.

    Args:
        edges: points of the path.
        row: rows of the points.
        place: position of the rows (n,) on the path, in points.
        rest: whether the arm rests (n,).
        segments: first rows of moves and rests, and the last row.

    Returns:
        Rows of the edges, ascending and distinct.
    """
    found, slack = list[int](), CYCLES.position_tolerance / CYCLES.spacing
    for edge in edges.tolist():
        near = segments[np.abs(place[segments] - edge) <= slack]
        moving = near[~rest[near]]
        found.append(int(moving[0] if moving.size else near[0] if near.size else row[edge]))
    return np.unique(found)
