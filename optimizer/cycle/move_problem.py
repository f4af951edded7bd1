"""Problem of one move of a cycle."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import PlannedMove


@dataclass(frozen=True)
class MoveSettings:
    """Settings of the problems of single moves."""

    least_time: float = 1e-3
    """Least deadline of a move [s]."""


MOVE = MoveSettings()


def problem_of(
    cycle: Cycle, move: PlannedMove, q_start: Array, q_goal: Array, time: float
) -> Problem:
    """Problem of a move between joint positions.

    Args:
        cycle: the cycle.
        move: its move.
        q_start: joint positions at the start, shape (nq,) [rad].
        q_goal: joint positions at the goal, shape (nq,) [rad].
        time: deadline [s].
    """
    return Problem(
        arm=move.arm,
        start=q_start,
        goal=q_goal,
        method=cycle.method,
        objective=cycle.objective,
        duration_max=None if cycle.objective == "electrical" else cycle.longest_move,
        tool_path=move.tool_path,
        windings=False,
        bound=cycle.bound,
        sample_period=cycle.sample_period,
        deadline=max(time, MOVE.least_time),
    )
