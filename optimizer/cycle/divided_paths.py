"""Paths of stops that no configuration follows whole, divided by reconfigurations where these cost
least.

The parts are as few as possible. Among divisions into as few, that one is taken whose
reconfigurations have the least lower bounds together, by dynamic programming over places along the
path and the strands on which the arm may be there (compare IKLink, Y. Wang, C. Sifferman, M.
Gleicher, 2024). At the places found, the cycle chooses the configurations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.bounds.lower_bound import lower_bounds
from joulepath.optimizer.cycle.layers import arms_at
from joulepath.optimizer.cycle.strands import Strand, strands_of
from joulepath.optimizer.cycle.ways import layers_of_stop
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.free_order import FreeOrder
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.tool_path import Section
from joulepath.optimizer.search.end_feasibility import check_configurations
from joulepath.optimizer.search.errors import PathInfeasible

# places at which a path may be divided: even fractions of it
PLACES = np.linspace(0.0, 1.0, 129)
# J: a reconfiguration costs more than any place can save
RECONFIGURATION = 1e6
# rounding, in full turns
TINY = 1e-9


def with_divided_paths(asked: Cycle) -> Cycle:
    """The cycle; a stop with a path that is to be divided, and that no configuration follows whole,
    is one stop for each part. The last one has its name, those before are called NAME/1, NAME/2, …

    Raises the errors of `layers_of_stop` for such stops.
    """
    stops, parts_of = list[Stop](), dict[str, list[str]]()
    for k, stop in enumerate(asked.stops):
        parts = _parts(asked, k) if stop.path is not None and stop.path.split else [stop]
        parts_of[stop.name] = [part.name for part in parts]
        stops += parts
    if len(stops) == len(asked.stops):
        return asked
    return replace(
        asked, stops=stops, order=None if asked.order is None else _order(asked.order, parts_of)
    )


def _order(order: FreeOrder, parts_of: dict[str, list[str]]) -> FreeOrder:
    """The same order, with the parts of a path one directly after the other."""
    listed = {name for names in order.together for name in names}
    together = [[part for name in names for part in parts_of[name]] for names in order.together]
    together += [parts for name, parts in parts_of.items() if name not in listed and len(parts) > 1]
    before = [(parts_of[first][-1], parts_of[second][0]) for first, second in order.before]
    return FreeOrder(before=before, together=together)


def _parts(asked: Cycle, k: int) -> list[Stop]:
    """The parts of a stop's path; the stop itself if some configuration follows it whole."""
    stop = asked.stops[k]
    try:
        layers_of_stop(asked, k)
    except PathInfeasible as error:
        if error.path != f"stops/{stop.name}":
            raise
        places = _places(asked, stop)
        if places is None:
            raise PathInfeasible(error.length, error.attempts, error.path, in_parts=True) from None
        return _divided(stop, places)
    return [stop]


def _divided(stop: Stop, places: Sequence[float]) -> list[Stop]:
    """One stop for each part between `places`."""
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


def _places(asked: Cycle, stop: Stop) -> list[float] | None:
    """The fractions at which a stop's path is divided; None if it cannot be followed so either."""
    assert (
        stop.path is not None and isinstance(stop.target, Pose) and isinstance(stop.path.goal, Pose)
    )
    (arm, *_) = (move.arm for move in asked.moves if move.goal == stop.name and move.kind == "path")
    course = ToolCourse.of(replace(stop.path.path, about=None), stop.target.T, stop.path.goal.T)
    strands = strands_of(arm, course, stop.branch)
    if not strands:
        return None
    rests = [
        Problem(arm=each, start=stop.target, goal=stop.target) for each in arms_at(asked, stop.name)
    ]
    free = PreparedProblem.of(Problem(arm=asked.arm, start=stop.target, goal=stop.target))
    return _cheapest(strands, *_costs(free, [PreparedProblem.of(each) for each in rests], strands))


def _costs(
    free: PreparedProblem, rests: Sequence[PreparedProblem], strands: Sequence[Strand]
) -> tuple[Mask, Array]:
    """Where the arm may follow each strand (p, s); and lower bounds (p, s, s) [J] of
    reconfigurations from one to another, infinite where the arm cannot rest."""
    on = np.stack([strand.covers(PLACES) for strand in strands], axis=1)
    q = np.stack([strand.configurations(PLACES) for strand in strands], axis=1)
    rest = on.copy()
    for prepared in rests:
        rest[rest] = [cause is None for cause in check_configurations(prepared, q[rest])]
    both = rest[:, :, None] & rest[:, None, :] & ~np.eye(len(strands), dtype=bool)
    cost = np.full(both.shape, np.inf)
    if both.any():
        place, first, second = np.nonzero(both)
        levels = np.zeros(on.shape)
        levels[rest] = [free.potential(each) for each in q[rest]]
        gain = levels[place, second] - levels[place, first]
        shift = _nearest(
            q[place, second] - q[place, first],
            _turns(free.arm.active_limits, strands),
            first,
            second,
        )
        cost[place, first, second] = lower_bounds(free, shift, gain)[0]
    return on, cost


def _turns(limits: Limits, strands: Sequence[Strand]) -> Array:
    """Least and greatest number (2, s, nq) of full turns by which all of a strand may be turned."""
    low, high = (
        np.array([bound(strand.q, axis=0) for strand in strands]) for bound in (np.min, np.max)
    )
    turn = 2 * np.pi
    return np.stack(
        [np.ceil((limits.q_min - low) / turn - TINY), np.floor((limits.q_max - high) / turn + TINY)]
    )


def _nearest(
    shift: Array, turns: Array, first: npt.NDArray[np.intp], second: npt.NDArray[np.intp]
) -> Array:
    """Displacements (n, nq) [rad] by the full turns that make them least, of those that both
    strands allow.
    """
    least, most = turns[0, second] - turns[1, first], turns[1, second] - turns[0, first]
    return np.asarray(shift + 2 * np.pi * np.clip(np.round(-shift / (2 * np.pi)), least, most))


def _cheapest(strands: Sequence[Strand], on: Mask, cost: Array) -> list[float] | None:
    """The places at which the arm changes from one strand to another: as few as possible, and the
    cheapest of these.
    """
    reached = np.where(on[0], 0.0, np.inf)
    changed: list[npt.NDArray[np.intp]] = []
    for place in range(1, len(PLACES)):
        # from the place before to this one along a strand, then perhaps to another one
        reached = np.where(on[place] & on[place - 1], reached, np.inf)
        by_change = reached[:, None] + cost[place] + RECONFIGURATION
        best = by_change.argmin(axis=0)
        cheaper = by_change[best, np.arange(len(strands))] < reached
        # at the end there is nothing to go on to
        cheaper &= place < len(PLACES) - 1
        changed.append(np.where(cheaper, best, np.arange(len(strands))))
        reached = np.where(cheaper, by_change[best, np.arange(len(strands))], reached)
    strand = int(reached.argmin())
    if not np.isfinite(reached[strand]):
        return None
    places = list[float]()
    for place in range(len(PLACES) - 1, 0, -1):
        before = int(changed[place - 1][strand])
        if before != strand:
            places.append(float(PLACES[place]))
        strand = before
    return places[::-1]
