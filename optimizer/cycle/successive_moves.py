"""The configurations that moves choose one after the other, at stops whose orientation is free in part.

A cycle chooses among orientations that are given; a move by itself looks for its own. So the cycle that chooses move by
move, and what is saved against it, are what successive calls of `optimize` make of it.
"""

from __future__ import annotations

from dataclasses import replace

from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.search.run import Run


def successively_chosen(asked: Cycle, end: Deadline, clock: Clock) -> Cycle | None:
    """The cycle whose stops have the joint positions that the moves choose; None if one of them has no motion in its
    share of the time.

    It is for cycles in their own time and order, with moves from stop to stop alone.
    """
    start, stops = asked.start, list[Stop]()
    for k, (stop, move) in enumerate(zip(asked.stops, asked.moves, strict=False)):
        if end.passed:
            return None
        problem = Problem(
            arm=move.arm,
            start=start,
            goal=stop.target,
            branch=stop.branch,
            method=asked.method,
            windings=asked.windings,
            sample_period=asked.sample_period,
            deadline=end.left / (len(asked.stops) - k),
        )
        try:
            found = Run(problem, (), clock).solution()
        except JoulepathError:
            return None
        if k == 0:
            asked = replace(asked, start=found.start.q)
        start = found.goal.q
        stops.append(replace(stop, target=start))
    return replace(asked, stops=stops)
