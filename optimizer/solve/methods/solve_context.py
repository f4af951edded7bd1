"""Input of a solve: one candidate of a problem, with the knowledge of the search about it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.duration_intervals import (
    DurationInterval,
    duration_intervals,
)


@dataclass(frozen=True, eq=False)
class SolveContext:
    """A candidate, its allowed durations, and the knowledge of the search about it."""

    prepared: PreparedProblem

    q_start: Array
    """Start configuration, shape (nq,) [rad]."""

    q_goal: Array
    """Goal configuration, shape (nq,) [rad]."""

    deadline: Deadline
    """When the solve ends."""

    interval: DurationInterval
    """Allowed durations, and the cost of a motion."""

    incumbent_cost: float = np.inf
    """Cost of the best motion known, as of `Method.cost_of`; infinite if none is known. Motions
    that collide and cost more are not solved further."""

    other_goals: Callable[[], Sequence[Array]] = tuple
    """Goals (nq,) [rad] of other candidates from the same start. While no motion is known, a path
    to any of them may do. Evaluated only when paths are planned."""

    is_sole: bool = False
    """Whether the problem has no other candidate."""

    was_postponed: bool = False
    """Whether the candidate was postponed: then clearance constraints on its own motion, and
    planning in few states, have failed."""

    is_from_planned_path: bool = False
    """Whether the motion that the candidate already has was found from a planned path."""

    start_curve: HeldPose | None = None
    """Self-motion along which the start slides; None if the start is fixed."""

    goal_curve: HeldPose | None = None
    """Self-motion along which the goal slides; None if the goal is fixed."""

    @staticmethod
    def of(
        prepared: PreparedProblem,
        q_start: Array,
        q_goal: Array,
        deadline: Deadline,
        interval: DurationInterval | None = None,
    ) -> SolveContext:
        """Context of a candidate, without knowledge of a search.

        Args:
            prepared: the problem.
            q_start: start configuration, shape (nq,) [rad].
            q_goal: goal configuration, shape (nq,) [rad].
            deadline: when the solve ends.
            interval: allowed durations and cost; None for the first interval of the problem.

        Returns:
            The context, without an incumbent.
        """
        if interval is None:
            interval = duration_intervals(prepared, q_goal)[0]
        return SolveContext(prepared, q_start, q_goal, deadline, interval)
