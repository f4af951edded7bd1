"""Other ways to go round the same stops: choosing move by move, and the nearest configurations at the controller's
default speed."""

from __future__ import annotations

import numpy as np

from optimizer.exceptions import DeadlineExceeded
from optimizer.search.baselines import baselines, nearest
from optimizer.search.baselines import saving as saving_of
from optimizer.sequence.round_search import RoundSearch
from optimizer.sequence.round_solution import RoundBaseline
from optimizer.sequence.timed_round import Timed, TimedSearch
from optimizer.solution import Baseline
from optimizer.trajectories.spline import lasting


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


def shared_alike(timing: TimedSearch, timed: Timed, ours: float) -> list[RoundBaseline]:
    """The same round with every move slowed or sped up alike, and with the fastest moves and a wait."""
    search, asked = timing.search, timing.asked
    free = [search.solutions.get(each) for each in search.pairs(timed.nodes)]
    found = list[RoundBaseline]()
    known = [each.trajectory.spline for each in free if each is not None]
    if len(known) == len(free):
        factor = timing.time / sum(spline.duration for spline in known)
        splines = [lasting(spline, spline.duration * factor) for spline in known]
        energies = [
            leg.prepared.energy(spline).electrical.total for leg, spline in zip(search.legs, splines, strict=True)
        ]
        dwells = sum(float(search.legs[k].dwell[g]) for k, _, g in search.pairs(timed.nodes))
        total = sum(energies) + dwells
        # slower than a motion within the limits is within them, but for torques against gravity, which do not change
        found.append(
            RoundBaseline("same_factor", timing.time + asked.dwelling, total, factor >= 1, saving_of(ours, total))
        )
    fastest = timing.fastest_then_waiting(timed)
    if fastest is not None:
        duration, total = fastest
        found.append(RoundBaseline("fastest_then_wait", duration, total, True, saving_of(ours, total)))
    return found


def of_chain(search: RoundSearch, nodes: list[int], ours: float) -> RoundBaseline | None:
    """The baseline `move_by_move` from the nodes of its chain; `ours` [J] is what it is compared with.

    None if it takes another time than is asked for.
    """
    moves = [search.solutions[each] for each in search.pairs(nodes)]
    theirs = search.cost(nodes)
    duration = sum(move.duration for move in moves) + search.asked.dwelling
    if not _takes_the_time(search, duration):
        return None
    return RoundBaseline("move_by_move", duration, theirs, True, saving_of(ours, theirs))


def controller_default(search: RoundSearch, start: int, ours: float) -> RoundBaseline | None:
    """The round by the robot's own controller: to the nearest configuration each time, at its default speed.

    None for a robot whose default is not known, or if it takes another time than is asked for.
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
    duration += search.asked.dwelling
    if not _takes_the_time(search, duration):
        return None
    return RoundBaseline("controller_default", duration, total, held, saving_of(ours, total))


def _takes_the_time(search: RoundSearch, duration: float) -> bool:
    """Whether a round of a duration [s] takes the time that is asked for."""
    asked = search.asked
    return (asked.duration_min or 0.0) <= duration <= (asked.duration_max or np.inf)
