"""Other ways to go round the same stops: choosing move by move, and the nearest configurations at
the controller's default speed."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np

from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import (
    CycleBaseline,
    CycleBaselineName,
    CycleSolution,
    Needed,
)
from joulepath.optimizer.cycle.moves import moves_of
from joulepath.optimizer.cycle.rests import dwell_energies, rest_sensitivity
from joulepath.optimizer.deadline import Clock
from joulepath.optimizer.dynamics.interval import Known, saving_interval
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.free_order import is_given_order_allowed
from joulepath.optimizer.result.energy import Sensitivity
from joulepath.optimizer.result.solution import Baseline, Solution
from joulepath.optimizer.search.baselines import baselines, nearest, saving


def move_by_move(search: CycleSearch) -> list[int] | None:
    """The nodes of the chain that takes the move of least energy at each stop, as single requests
    would.

    The first move chooses the configuration at the start, too; the last one of a closed cycle has
    no choice. None if some move has no motion, or the time is up. All motions of the chain are in
    the search's `solutions` then.
    """
    nodes = list[int]()
    for k, leg in enumerate(search.legs):
        starts, goals = (
            np.array(nodes[-1:] or range(len(leg.start.q))),
            np.array(_goals(search, k, nodes)),
        )
        while True:
            # the dwell is no part of the move
            costs = leg.cost[np.ix_(starts, goals)] - leg.dwell[goals]
            first, last = np.unravel_index(costs.argmin(), costs.shape)
            s, g = int(starts[first]), int(goals[last])
            if len(starts) > 1:
                # of pairs that differ in common full turns, the one with most range left for the
                # moves to come
                s, g = leg.pair[leg.kind[s, g]].tolist()
            if not np.isfinite(leg.cost[s, g]):
                return None
            if leg.known(s, g):
                break
            if search.search_end.passed:
                return None
            search.try_kind(k, s, g)
        nodes = [*(nodes or [s]), g]
    try:
        for each in search.pairs(nodes):
            if each not in search.solutions:
                search.finish(*each)
    except DeadlineExceeded:
        return None
    return nodes if all(each in search.solutions for each in search.pairs(nodes)) else None


def given_order(
    asked: Cycle, left: float, ours: CycleSolution, clock: Clock
) -> CycleBaseline | None:
    """The best cycle in the order in which the stops are given, found within the `left` [s] of the
    deadline.

    None if it is the same as `ours` or not allowed, if there is none, or if it takes another time
    than is asked for.
    """
    same = [stop.name for stop in asked.stops] == ours.order
    if (
        left <= 0
        or same
        or (asked.order is not None and not is_given_order_allowed(asked.order, asked.stops))
    ):
        return None
    try:
        search = CycleSearch(replace(asked, order=None, deadline=left), clock)
        return of_chain(search, search.run(), "given_order", ours.needed)
    except JoulepathError:
        return None


def of_chain(
    search: CycleSearch, nodes: list[int], name: CycleBaselineName, ours: Needed
) -> CycleBaseline | None:
    """The baseline of a chain whose motions are known, with its moves; `ours` is what it is
    compared with.

    None if it takes another time than is asked for.
    """
    moves = [search.solutions[each] for each in search.pairs(nodes)]
    # added up as our cycle is: the same chain needs the same to the last digit
    energy = sum(
        a.energy.electrical.total + b for a, b in zip(moves, dwells_of(search, nodes), strict=True)
    )
    duration = sum(move.duration for move in moves) + search.asked.dwelling
    if search.asked.nearest_duration(duration) != duration:
        return None
    sensitivity = reduce(add, [move.sensitivity for move in moves]) + resting(search, nodes)
    known = Known(energy, sensitivity, sum(move.duration for move in moves))
    theirs = Needed(known, sum(move.energy.mechanical.total for move in moves))
    baseline = compared(search.asked, name, duration, theirs, True, ours)
    return replace(baseline, moves=moves_of(search, nodes, moves, {}))


def controller_default(search: CycleSearch, start: int, ours: Needed) -> CycleBaseline | None:
    """The cycle by the robot's own controller: to the nearest configuration each time, at its
    default speed.

    None for a robot whose default is not known, or if it takes another time than is asked for.
    """
    node, total, work, duration, held = start, 0.0, 0.0, 0.0, True
    nodes, sensitivities = [start], list[Sensitivity]()
    for k, leg in enumerate(search.legs):
        if search.asked.moves[k].tool_path is not None:
            # a controller's own line or path is not known: it is ours
            own = _on_way(search, k, node)
            if own is None:
                return None
            total, work = total + own.energy.electrical.total, work + own.energy.mechanical.total
            duration += own.duration
            nodes.append(node)
            sensitivities.append(own.sensitivity)
            continue
        goals = _goals(search, k, nodes)
        prepared, q_start = leg.prepared, leg.start.q[node]
        q_goal = nearest(prepared.problem, q_start, leg.goal.q[goals])
        node = next(g for g in goals if (leg.goal.q[g] == q_goal).all())
        found: dict[str, Baseline] = {
            each.name: each
            for each in baselines(
                prepared.problem,
                q_start,
                q_goal[None],
                1.0,
                0.0,
                prepared.torques,
                prepared.potential,
                prepared.broken_on_the_way,
            )
        }
        if "controller_default" not in found:
            return None
        move = found["controller_default"]
        total, work = total + move.electrical, work + move.mechanical
        duration += move.duration
        held &= move.within_limits
        nodes.append(node)
        sensitivities.append(move.sensitivity)
    duration += search.asked.dwelling
    if search.asked.nearest_duration(duration) != duration:
        return None
    sensitivity = reduce(add, sensitivities) + resting(search, nodes)
    known = Known(
        total + sum(dwells_of(search, nodes)), sensitivity, duration - search.asked.dwelling
    )
    return compared(search.asked, "controller_default", duration, Needed(known, work), held, ours)


def compared_again(asked: Cycle, known: CycleBaseline, ours: Needed) -> CycleBaseline:
    """A known baseline beside another round of ours."""
    again = compared(asked, known.name, known.duration, known.needed, known.within_limits, ours)
    return replace(again, moves=known.moves)


def compared(
    asked: Cycle, name: CycleBaselineName, duration: float, theirs: Needed, held: bool, ours: Needed
) -> CycleBaseline:
    """The baseline of a cycle that takes `duration` [s], rests included, and needs `theirs`."""
    electrical = asked.objective == "electrical"
    interval = (
        saving_interval(ours.electrical, theirs.electrical, asked.arm) if electrical else None
    )
    own = saving(ours.of(asked.objective), theirs.of(asked.objective))
    return CycleBaseline(
        name=name,
        duration=duration,
        within_limits=held,
        saving=own,
        saving_interval=interval,
        needed=theirs,
    )


def dwells_of(search: CycleSearch, nodes: list[int]) -> list[float]:
    """Electrical energy [J] of the dwell after each move of a chain."""
    moves = zip(search.asked.moves, search.legs, nodes[1:], strict=True)
    return [float(dwell_energies(search.asked, move, leg.goal)[node]) for move, leg, node in moves]


def resting(
    search: CycleSearch, nodes: list[int], at: int = -1, waited: float = 0.0
) -> Sensitivity:
    """How the energy of the dwells of a chain hangs on the arm's figures, with a wait [s] after
    move `at`.
    """
    asked = search.asked
    rests = [
        rest_sensitivity(
            asked, move, move.dwell + (waited if k == at else 0.0), search.legs[k].goal.q[node]
        )
        for k, (move, node) in enumerate(zip(asked.moves, nodes[1:], strict=True))
    ]
    return reduce(add, rests)


def _on_way(search: CycleSearch, move: int, node: int) -> Solution | None:
    """The certified motion along a line or a path; None if there is none, or the time is up."""
    key = (move, node, node)
    if key not in search.solutions:
        try:
            search.finish(*key)
        except DeadlineExceeded:
            return None
    return search.solutions.get(key)


def _goals(search: CycleSearch, move: int, nodes: list[int]) -> list[int]:
    """The nodes to which a move may lead: a closed round ends in the node from which it went out,
    the first of `nodes`."""
    last = search.asked.closed and move == len(search.legs) - 1
    return nodes[:1] if last else list(range(len(search.legs[move].goal.q)))
