"""The configurations that moves choose one after the other, at stops that leave some freedom.

A cycle chooses among orientations and postures that are given; a move by itself looks for its own.
So the cycle that chooses move by move, and what is saved against it, are what successive calls of
`optimize` make of it. Their motions are known then.
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


def successively_chosen(asked: Cycle, end: Deadline, clock: Clock) -> Cycle | None:
    """The cycle whose stops have the joint positions that the moves choose; None if one of them has
    no motion in its share of the time.

    It is for cycles in their own time and order, with moves from stop to stop alone.
    """
    start, stops = asked.start, list[Stop]()
    for k, (stop, move) in enumerate(zip(asked.stops, asked.moves, strict=False)):
        if end.passed:
            return None
        left, share = end.left, end.left / (len(asked.stops) - k)
        problem = Problem(
            arm=move.arm,
            start=start,
            goal=stop.target,
            branch=stop.branch,
            method=asked.method,
            windings=asked.windings,
            sample_period=asked.sample_period,
            deadline=share,
        )
        try:
            found = Run(problem, (), clock).solution()
        except JoulepathError:
            return None
        if k == 0:
            asked = replace(asked, start=found.start.q)
        start = found.goal.q
        if end.left > left - share / 2:
            # more time would not make it better
            own, motions = problem_of(asked, move, found.start.q, start, share), known_motions()
            motion = KnownMotion(found.trajectory.spline, found.solver.stationarity)
            motions.keep(motions.key("finished", own, []), motion)
        stops.append(replace(stop, target=start))
    return replace(asked, stops=stops)
