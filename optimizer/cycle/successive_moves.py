"""Configurations chosen move by move, at stops that leave some freedom.

A cycle chooses among given orientations and postures, a single move searches its own. The baseline
of a cycle chosen move by move is therefore built from successive calls of `optimize`, whose motions
are kept as known motions.
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
from joulepath.optimizer.search.run import Run


def successively_chosen(cycle: Cycle, end: Deadline, clock: Clock) -> Cycle | None:
    """The cycle with the joint positions chosen by successive moves as targets.

    Only for cycles in their own time and order, with moves from stop to stop alone.

    Args:
        cycle: the cycle.
        end: deadline of all moves.
        clock: function that returns the time [s].

    Returns:
        The cycle; None if a move has no motion in its share of the time.
    """
    start, stops = cycle.start, list[Stop]()
    for k, (stop, move) in enumerate(zip(cycle.stops, cycle.moves, strict=False)):
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
