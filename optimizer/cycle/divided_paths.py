"""Division of paths at stops by reconfigurations, where no configuration follows the whole path.

The number of parts is the least possible. Among divisions into this number of parts, the one with
the least sum of lower bounds on its reconfigurations is found by dynamic programming over places
along the path and the segments that the arm can follow there (compare IKLink, Y. Wang, C.
Sifferman, M. Gleicher, 2024). The search for the cycle then chooses the configurations at these
places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.bounds.lower_bound import lower_bounds
from joulepath.optimizer.cycle.layers import first_causes, rests_at
from joulepath.optimizer.cycle.path_segments import PathSegment, path_segments
from joulepath.optimizer.cycle.stop_layers import layers_of_stop
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.prepared_problem import ModelsOfArms, PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.free_order import FreeOrder
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.tool_path import Section
from joulepath.optimizer.search.errors import PathInfeasible


@dataclass(frozen=True)
class DivisionSettings:
    """Settings of the division of paths."""

    spans: int = 128
    """Even spans of a path, between which it may be divided."""
    reconfiguration: float = 1e6
    """Cost of a reconfiguration [J]: more than the choice of its place can save."""
    turn_rounding: float = 1e-9
    """Rounding error of a number of full turns [1]."""


DIVISION = DivisionSettings()
PLACES = np.linspace(0.0, 1.0, DIVISION.spans + 1)
"""Fractions of a path at which it may be divided."""


def with_divided_paths(cycle: Cycle) -> Cycle:
    """The cycle with every path divided that no configuration follows whole.

    A stop with such a path becomes one stop for every part, named NAME/1, NAME/2, …; the last part
    has the name of the stop.

    Raises:
        JoulepathError: the errors of `layers_of_stop` for stops with a divisible path.
    """
    stops, parts_of, models = list[Stop](), dict[str, list[str]](), ModelsOfArms()
    for k, stop in enumerate(cycle.stops):
        parts = _parts(cycle, models, k) if stop.path is not None and stop.path.split else [stop]
        parts_of[stop.name] = [part.name for part in parts]
        stops += parts
    if len(stops) == len(cycle.stops):
        return cycle
    return replace(
        cycle, stops=stops, order=None if cycle.order is None else _order(cycle.order, parts_of)
    )


def _order(order: FreeOrder, parts_of: dict[str, list[str]]) -> FreeOrder:
    """The order with the parts of a path directly after one another."""
    listed = {name for names in order.together for name in names}
    together = [[part for name in names for part in parts_of[name]] for names in order.together]
    together += [parts for name, parts in parts_of.items() if name not in listed and len(parts) > 1]
    before = [(parts_of[first][-1], parts_of[second][0]) for first, second in order.before]
    return FreeOrder(before=before, together=together)


def _parts(cycle: Cycle, models: ModelsOfArms, k: int) -> list[Stop]:
    """Parts of the path of stop `k`; the stop itself if some configuration follows the whole
    path.
    """
    stop = cycle.stops[k]
    try:
        layers_of_stop(cycle, models, k)
    except PathInfeasible as error:
        if error.is_line:
            raise
        places = _places(cycle, models, stop)
        if places is None:
            raise replace(error, in_parts=True) from None
        return _divided(stop, places)
    return [stop]


def _divided(stop: Stop, places: Sequence[float]) -> list[Stop]:
    """One stop for every part of the path between `places`."""
    assert (
        stop.path is not None and isinstance(stop.target, Pose) and isinstance(stop.path.goal, Pose)
    )
    course = ToolCourse.of(stop.path.path, stop.target.T, stop.path.goal.T)
    poses = [stop.target, *(Pose(T) for T in course.poses(np.array(places))), stop.path.goal]
    ends, parts = [0.0, *places, 1.0], list[Stop]()
    for n in range(len(poses) - 1):
        section = Section(stop.target, stop.path.goal, ends[n], ends[n + 1])
        way = replace(
            stop.path, goal=poses[n + 1], path=replace(stop.path.path, section=section), split=False
        )
        part = replace(stop, target=poses[n], path=way)
        last = n == len(poses) - 2
        parts.append(
            part if last else replace(part, name=f"{stop.name}/{n + 1}", dwell=0.0, payload=None)
        )
    return parts


def _places(cycle: Cycle, models: ModelsOfArms, stop: Stop) -> list[float] | None:
    """Fractions at which the path of a stop is divided; None if it cannot be followed in parts
    either.
    """
    assert (
        stop.path is not None and isinstance(stop.target, Pose) and isinstance(stop.path.goal, Pose)
    )
    (arm, *_) = (move.arm for move in cycle.moves if move.goal == stop.name and move.kind == "path")
    course = ToolCourse.of(replace(stop.path.path, about=None), stop.target.T, stop.path.goal.T)
    segments = path_segments(arm, course, stop.branch)
    if not segments:
        return None
    rests = rests_at(cycle, models, stop.name, stop.target)
    free = models.prepared(Problem(arm=cycle.arm, start=stop.target, goal=stop.target))
    return _cheapest_division(segments, *_reconfiguration_bounds(free, rests, segments))


def _reconfiguration_bounds(
    free: PreparedProblem, rests: Sequence[PreparedProblem], segments: Sequence[PathSegment]
) -> tuple[Mask, Array]:
    """Places on the segments, and lower bounds on reconfigurations there.

    Args:
        free: problem without a path, for the bounds.
        rests: problems of the arms at rest on the path.
        segments: segments of the path.

    Returns:
        Whether the arm may follow every segment at every place, shape (p, s), and lower bounds on
        changes from one segment to another, shape (p, s, s) [J], infinite where the arm cannot
        rest.
    """
    on = np.stack([segment.covers(PLACES) for segment in segments], axis=1)
    q = np.stack([segment.configurations(PLACES) for segment in segments], axis=1)
    rest = on.copy()
    rest[rest] = [cause is None for cause in first_causes(rests, q[rest])]
    both = rest[:, :, None] & rest[:, None, :] & ~np.eye(len(segments), dtype=bool)
    cost = np.full(both.shape, np.inf)
    if both.any():
        place, first, second = np.nonzero(both)
        levels = np.zeros(on.shape)
        levels[rest] = [free.potential(each) for each in q[rest]]
        gain = levels[place, second] - levels[place, first]
        shift = _with_nearest_turns(
            q[place, second] - q[place, first],
            _allowed_turns(free.arm.active_limits, segments),
            first,
            second,
        )
        cost[place, first, second] = lower_bounds(free, shift, gain)[0]
    return on, cost


def _allowed_turns(limits: Limits, segments: Sequence[PathSegment]) -> Array:
    """Least and greatest number of full turns (2, s, nq) by which the joints of a segment may be
    turned.
    """
    low, high = (
        np.array([bound(segment.q, axis=0) for segment in segments]) for bound in (np.min, np.max)
    )
    turn = 2 * np.pi
    return np.stack(
        [
            np.ceil((limits.q_min - low) / turn - DIVISION.turn_rounding),
            np.floor((limits.q_max - high) / turn + DIVISION.turn_rounding),
        ]
    )


def _with_nearest_turns(
    shift: Array, turns: Array, first: npt.NDArray[np.intp], second: npt.NDArray[np.intp]
) -> Array:
    """Displacements (n, nq) [rad] between segments, shortened by full turns within their ranges."""
    least, most = turns[0, second] - turns[1, first], turns[1, second] - turns[0, first]
    return np.asarray(shift + 2 * np.pi * np.clip(np.round(-shift / (2 * np.pi)), least, most))


def _cheapest_division(
    segments: Sequence[PathSegment], on: Mask, cost: Array
) -> list[float] | None:
    """Places at which the arm changes the segment: fewest changes first, then least cost."""
    reached = np.where(on[0], 0.0, np.inf)
    changed: list[npt.NDArray[np.intp]] = []
    for place in range(1, len(PLACES)):
        # along a segment to this place, then perhaps to another segment
        reached = np.where(on[place] & on[place - 1], reached, np.inf)
        by_change = reached[:, None] + cost[place] + DIVISION.reconfiguration
        best = by_change.argmin(axis=0)
        cheaper = by_change[best, np.arange(len(segments))] < reached
        # no reconfiguration at the end
        cheaper &= place < len(PLACES) - 1
        changed.append(np.where(cheaper, best, np.arange(len(segments))))
        reached = np.where(cheaper, by_change[best, np.arange(len(segments))], reached)
    segment = int(reached.argmin())
    if not np.isfinite(reached[segment]):
        return None
    places = list[float]()
    for place in range(len(PLACES) - 1, 0, -1):
        before = int(changed[place - 1][segment])
        if before != segment:
            places.append(float(PLACES[place]))
        segment = before
    return places[::-1]
