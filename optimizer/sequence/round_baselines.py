"""Other ways to go round the same stops: choosing move by move, and the nearest configurations at the controller's
default speed."""

from __future__ import annotations

import numpy as np

from optimizer.exceptions import DeadlineExceeded
from optimizer.search.baselines import baselines, nearest
from optimizer.search.baselines import saving as saving_of
from optimizer.sequence.round_search import RoundSearch
from optimizer.sequence.round_solution import RoundBaseline
from optimizer.solution import Baseline


def move_by_move(search: RoundSearch, start: int) -> list[int] | None:
    """The nodes of the chain that takes the move of least energy at each stop, from node `start` of the first layer.

    The last move of a closed round has no choice. None if some move has no motion, or the time is up. All motions of
    the chain are in the search's `solutions` then.
    """
    nodes = [start]
    for k, leg in enumerate(search.legs):
        goals = [start] if search.asked.closed and k == len(search.legs) - 1 else range(len(leg.goal.q))
        s = nodes[-1]
        while True:
            # the dwell is no part of the move
            g = min(goals, key=lambda each: float(leg.cost[s, each] - leg.dwell[each]))
            if not np.isfinite(leg.cost[s, g]):
                return None
            if leg.known(s, g):
                break
            if search.search_end.passed:
                return None
            search.try_kind(k, s, g)
        nodes.append(g)
    try:
        for each in search.pairs(nodes):
            if each not in search.solutions:
                search.finish(*each)
    except DeadlineExceeded:
        return None
    return nodes if all(each in search.solutions for each in search.pairs(nodes)) else None


def of_chain(search: RoundSearch, nodes: list[int], ours: float) -> RoundBaseline:
    """The baseline `move_by_move` from the nodes of its chain; `ours` [J] is what it is compared with."""
    moves = [search.solutions[each] for each in search.pairs(nodes)]
    theirs = search.cost(nodes)
    duration = sum(move.duration for move in moves) + sum(stop.dwell for stop in search.asked.stops)
    return RoundBaseline("move_by_move", duration, theirs, True, saving_of(ours, theirs))


def controller_default(search: RoundSearch, start: int, ours: float) -> RoundBaseline | None:
    """The round by the robot's own controller: to the nearest configuration each time, at its default speed.

    None for a robot whose default is not known.
    """
    node, total, duration, held = start, 0.0, 0.0, True
    for k, leg in enumerate(search.legs):
        goals = [start] if search.asked.closed and k == len(search.legs) - 1 else list(range(len(leg.goal.q)))
        prepared, q_start = leg.prepared, leg.start.q[node]
        q_goal = nearest(prepared.problem, q_start, leg.goal.q[goals])
        node = next(g for g in goals if (leg.goal.q[g] == q_goal).all())
        found: dict[str, Baseline] = {
            each.name: each
            for each in baselines(
                prepared.problem, q_start, q_goal[None], 1.0, 0.0,
                prepared.torques, prepared.potential, prepared.satisfies_path_constraints,
            )
        }  # fmt: skip
        if "controller_default" not in found:
            return None
        move = found["controller_default"]
        total += move.electrical + float(leg.dwell[node])
        duration += move.duration
        held &= move.within_limits
    duration += sum(stop.dwell for stop in search.asked.stops)
    return RoundBaseline("controller_default", duration, total, held, saving_of(ours, total))
