"""Baselines of a cycle: moves chosen one by one, and the robot's own controller at its default
speed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import (
    CycleBaseline,
    CycleBaselineName,
    CycleEnergies,
    CycleSolution,
    energies_of,
)
from joulepath.optimizer.cycle.moves import moves_of
from joulepath.optimizer.cycle.rest_energy import dwell_energies, rest_sensitivity
from joulepath.optimizer.deadline import Clock
from joulepath.optimizer.dynamics.interval import MotionEnergy, saving_interval
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.free_order import is_given_order_allowed
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.result.cycle import BrokenMove
from joulepath.optimizer.result.energy import Sensitivity
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.baselines import baselines, nearest


def move_by_move(search: CycleSearch) -> list[int] | None:
    """Nodes of the chain that takes the move of least energy at every stop, like single requests.

    The first move also chooses the configuration at the start; the last move of a closed cycle has
    no choice. All motions of the chain are then among the search's `solutions`.

    Returns:
        The nodes; None if some move has no motion, or the time is up.
    """
    nodes = list[int]()
    for k, leg in enumerate(search.legs):
        starts, goals = (
            np.array(nodes[-1:] or range(len(leg.start.q))),
            np.array(_possible_goals(search, k, nodes)),
        )
        while True:
            # without the dwell, which is no part of the move
            costs = leg.cost[np.ix_(starts, goals)] - leg.dwell[goals]
            first, last = np.unravel_index(costs.argmin(), costs.shape)
            s, g = int(starts[first]), int(goals[last])
            if len(starts) > 1:
                # of pairs that differ by common full turns, the one farthest from the limits
                s, g = leg.pair[leg.kind[s, g]].tolist()
            if not np.isfinite(leg.cost[s, g]):
                return None
            if leg.is_pair_solved(s, g):
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
    cycle: Cycle, left: float, ours: CycleSolution, clock: Clock
) -> CycleBaseline | None:
    """Best cycle in the given order of the stops, as a baseline of a cycle with a free order.

    Args:
        cycle: cycle with a free order.
        left: time for the search [s].
        ours: solution with the best order found.
        clock: function that returns the time [s].

    Returns:
        The baseline; None if its order is ours or not allowed, or if no such cycle of an allowed
        duration is found.
    """
    same = [stop.name for stop in cycle.stops] == ours.order
    if (
        left <= 0
        or same
        or (cycle.order is not None and not is_given_order_allowed(cycle.order, cycle.stops))
    ):
        return None
    try:
        search = CycleSearch(replace(cycle, order=None, deadline=left), clock)
        return chain_baseline(search, search.run(), "given_order", ours.energies)
    except JoulepathError:
        return None


def chain_baseline(
    search: CycleSearch, nodes: list[int], name: CycleBaselineName, ours: CycleEnergies
) -> CycleBaseline | None:
    """Baseline of a chain with known motions, compared with our energies; None if its duration is
    not allowed.
    """
    found = [search.solutions[each] for each in search.pairs(nodes)]
    duration = sum(each.duration for each in found) + search.cycle.dwell_time
    if search.cycle.clamped_duration(duration) != duration:
        return None
    # the same chain as ours has the same energy bit for bit
    moves = moves_of(search, nodes, found, {})
    baseline = cycle_baseline(search.cycle, name, duration, energies_of(moves), [], ours)
    return replace(baseline, moves=moves)


def controller_default(
    search: CycleSearch, start: int, ours: CycleEnergies
) -> CycleBaseline | None:
    """The cycle by the robot's own controller: nearest configurations, at its default speed.

    Args:
        search: search with the configurations.
        start: node at the start.
        ours: energies of our cycle.

    Returns:
        The baseline; None if the default speed is not known, or the duration is not allowed.
    """
    node, total, work, duration = start, 0.0, 0.0, 0.0
    nodes, sensitivities = [start], list[Sensitivity]()
    motions = list[tuple[PlannedMove, str | None]]()
    for k, leg in enumerate(search.legs):
        if search.cycle.moves[k].tool_path is not None:
            # a controller's own motion along a line or path is not known: ours replaces it
            own = _finished_solution(search, k, node)
            if own is None:
                return None
            total, work = total + own.energy.electrical.total, work + own.energy.mechanical.total
            duration += own.duration
            nodes.append(node)
            sensitivities.append(own.sensitivity)
            continue
        goals = _possible_goals(search, k, nodes)
        prepared, q_start = leg.prepared, leg.start.q[node]
        q_goal = nearest(prepared.problem, q_start, leg.goal.q[goals])
        node = next(g for g in goals if (leg.goal.q[g] == q_goal).all())
        move = _default_motion(prepared, q_start, q_goal)
        if move is None:
            return None
        total, work = total + move.electrical, work + move.mechanical
        duration += move.duration
        motions.append((search.cycle.moves[k], move.reason))
        nodes.append(node)
        assert move.sensitivity is not None
        sensitivities.append(move.sensitivity)
    duration += search.cycle.dwell_time
    if search.cycle.clamped_duration(duration) != duration:
        return None
    sensitivity = reduce(add, sensitivities) + rest_sensitivity_of_chain(search, nodes)
    known = MotionEnergy(
        total + sum(dwell_energies_of_chain(search, nodes)),
        sensitivity,
        duration - search.cycle.dwell_time,
    )
    return cycle_baseline(
        search.cycle,
        "controller_default",
        duration,
        CycleEnergies(known, work),
        broken_moves(motions),
        ours,
    )


def _default_motion(prepared: PreparedProblem, q_start: Array, q_goal: Array) -> Baseline | None:
    """Motion of the robot's own controller at its default speed; None if this is not known."""
    oracle = prepared.torques, prepared.potential, prepared.broken_on_the_way
    found = baselines(prepared.problem, q_start, q_goal[None], 1.0, 0.0, *oracle)
    return next((motion for motion in found if motion.name == "controller_default"), None)


def broken_moves(motions: Iterable[tuple[PlannedMove, str | None]]) -> list[BrokenMove]:
    """The moves whose motions break limits, by the reasons of all motions."""
    return [BrokenMove(move.start, move.goal, why) for move, why in motions if why is not None]


def recompared(cycle: Cycle, known: CycleBaseline, ours: CycleEnergies) -> CycleBaseline:
    """A baseline, compared with another solution of ours."""
    again = cycle_baseline(cycle, known.name, known.duration, known.energies, known.broken, ours)
    return replace(again, moves=known.moves)


def cycle_baseline(
    cycle: Cycle,
    name: CycleBaselineName,
    duration: float,
    theirs: CycleEnergies,
    broken: list[BrokenMove],
    ours: CycleEnergies,
) -> CycleBaseline:
    """Baseline with its saving.

    Args:
        cycle: the cycle.
        name: name of the baseline.
        duration: its duration with rests [s].
        theirs: its energies.
        broken: its moves that break limits.
        ours: energies of our cycle.
    """
    electrical = cycle.objective == "electrical"
    interval = (
        saving_interval(ours.electrical, theirs.electrical, cycle.arm) if electrical else None
    )
    own = saving(ours.of(cycle.objective), theirs.of(cycle.objective))
    return CycleBaseline(
        name=name,
        duration=duration,
        broken=broken,
        saving=own,
        saving_interval=interval,
        energies=theirs,
    )


def dwell_energies_of_chain(search: CycleSearch, nodes: list[int]) -> list[float]:
    """Electrical energy [J] of the dwell after every move of a chain."""
    moves = zip(search.cycle.moves, search.legs, nodes[1:], strict=True)
    return [float(dwell_energies(search.cycle, move, leg.goal)[node]) for move, leg, node in moves]


def rest_sensitivity_of_chain(
    search: CycleSearch, nodes: list[int], at: int = -1, waited: float = 0.0
) -> Sensitivity:
    """Sensitivity of the energy of a chain's dwells to the arm's figures, with a wait [s] after
    move `at`.
    """
    cycle = search.cycle
    rests = [
        rest_sensitivity(
            cycle, move, move.dwell + (waited if k == at else 0.0), search.legs[k].goal.q[node]
        )
        for k, (move, node) in enumerate(zip(cycle.moves, nodes[1:], strict=True))
    ]
    return reduce(add, rests)


def _finished_solution(search: CycleSearch, move: int, node: int) -> Solution | None:
    """Certified motion along a line or a path; None if there is none, or the time is up."""
    key = (move, node, node)
    if key not in search.solutions:
        try:
            search.finish(*key)
        except DeadlineExceeded:
            return None
    return search.solutions.get(key)


def _possible_goals(search: CycleSearch, move: int, nodes: list[int]) -> list[int]:
    """Nodes that a move may lead to; the last move of a closed cycle leads to the first of
    `nodes`.
    """
    last = search.cycle.closed and move == len(search.legs) - 1
    return nodes[:1] if last else list(range(len(search.legs[move].goal.q)))
