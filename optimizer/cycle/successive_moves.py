"""Configurations of a cycle chosen by single moves, one after another.

A cycle chooses among samples of free orientations and postures; a single move searches its own.
"""

from __future__ import annotations

from dataclasses import replace

from joulepath.optimizer.cycle.known_motions import KnownMotion, known_motions
from joulepath.optimizer.cycle.move_problem import problem_of
from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import AnyOf
from joulepath.optimizer.search.run import Run


def has_successive_moves(cycle: Cycle) -> bool:
    """Whether the configurations of successively chosen moves are compared."""
    is_electrical = cycle.objective == "electrical" and cycle.arm.bus.mode != "storage"
    return cycle.order is None and is_electrical and _has_single_places(cycle)


def _has_single_places(cycle: Cycle) -> bool:
    """Whether every stop has a single target, and neither lines nor a path."""
    return all(len(stop.places) == 1 and not isinstance(stop.target, AnyOf) for stop in cycle.stops)


def successively_chosen(cycle: Cycle, end: Deadline, clock: Clock) -> Cycle | None:
    """The cycle with the joint positions chosen by successive moves as targets.

    Only for cycles in their own order, with moves from stop to stop alone. A cycle chooses among
    given orientations and postures, a single move searches its own: the moves are those of
    successive calls of `optimize`, and are kept as known motions. They take their own time, and
    rest at every stop, as if the cycle had neither a given time nor passes.

    Args:
        cycle: the cycle.
        end: deadline of all moves.
        clock: function that returns the time [s].

    Returns:
        The cycle; None if a move has no motion in its share of the time.
    """
    start, stops = cycle.start, list[Stop]()
    moves = replace(cycle, rests_at_passes=True).moves
    for k, (stop, move) in enumerate(zip(cycle.stops, moves, strict=False)):
        if end.passed:
            return None
        left, share = end.left, end.left / (len(cycle.stops) - k)
        problem = Problem(
            arm=move.arm,
            start=start,
            goal=stop.target,
            branch=stop.branch,
            method=cycle.method,
            windings=cycle.windings,
            sample_period=cycle.sample_period,
            deadline=share,
        )
        try:
            found = Run(problem, (), clock).solution()
        except JoulepathError:
            return None
        if k == 0:
            cycle = replace(cycle, start=found.start.q)
        start = found.goal.q
        if end.left > left - share / 2:
            # not limited by the deadline: more time would not improve the motion
            own, motions = problem_of(cycle, move, found.start.q, start, share), known_motions()
            motion = KnownMotion(found.trajectory.spline, found.solver.stationarity)
            motions.keep(motions.key("finished", own, []), motion)
        stops.append(replace(stop, target=start))
    return replace(cycle, stops=stops)
