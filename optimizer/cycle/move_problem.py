"""The problem of one move of a cycle."""

from __future__ import annotations

from joulepath.models.robot import Array
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import PlannedMove

# least time [s] for a motion
LEAST_TIME = 1e-3


def problem_of(
    asked: Cycle, move: PlannedMove, q_start: Array, q_goal: Array, time: float
) -> Problem:
    """The problem of a move of a cycle between joint positions (nq,) [rad], with `time` [s] for
    it."""
    return Problem(
        arm=move.arm,
        start=q_start,
        goal=q_goal,
        method=asked.method,
        objective=asked.objective,
        duration_max=None if asked.objective == "electrical" else asked.longest_move,
        tool_path=move.tool_path,
        windings=False,
        sample_period=asked.sample_period,
        deadline=max(time, LEAST_TIME),
    )
