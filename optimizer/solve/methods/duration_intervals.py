"""Intervals of durations on which the objective of a candidate is smooth.

Without a dwell and without energy storage, one interval holds all durations, and the cost is the
objective. In a dwell, the energy of waiting is linear in the duration on either side of the instant
at which the brakes engage: this makes two intervals, with an exact weight on time. The saving of an
energy storage depends on the charge over the whole motion: the cost values a joule of net surplus
at a constant `surplus_value`, and motions are compared by their exact energy.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.dwell import LinearDwell, holding_times, linear_dwells
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion.bspline import BASIS
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.solve.nlp.goal_holding import GoalHolding


@dataclass(frozen=True)
class DurationInterval:
    """Allowed durations, and the cost of a motion."""

    p: Array
    """Packed parameters of the kernel."""

    t_min: float
    """Smallest duration [s]."""

    t_max: float
    """Largest duration [s]."""

    constant: float = 0.0
    """Constant part of the cost [J]."""

    minimum_time: bool = False
    """Whether the cost is the duration."""

    price: float = 0.0
    """Price of time, added to the objective of the problem [W]."""

    goal_holding: GoalHolding | None = None
    """Energy of waiting at another goal in a dwell; None without a dwell."""

    least_nodes: int = BASIS.least_nodes
    """Least number of quadrature nodes of the cost with knots at the switches of jerk."""


def duration_intervals(
    prepared: PreparedProblem,
    q_goal: Array,
    surplus_value: float | None = None,
    width: float = SMOOTHING.power_width,
    friction_share: float = 1.0,
) -> list[DurationInterval]:
    """Intervals of a problem, in order of duration.

    Args:
        prepared: the problem.
        q_goal: goal configuration, shape (nq,) [rad].
        surplus_value: value of a joule of net surplus with energy storage [1]; None for the highest
            possible value.
        width: width over which corners of the cost are smoothed [W].
        friction_share: as in `Plant.parameters`.
    """
    problem = prepared.problem
    t_min = DURATIONS.least if problem.duration_min is None else problem.duration_min
    t_max = DURATIONS.longest if problem.duration_max is None else problem.duration_max
    if surplus_value is None and problem.arm.bus.mode == "storage":
        surplus_value = max(problem.arm.bus.efficiency, problem.arm.regeneration)
    parameters = partial(
        prepared.parameters,
        regeneration=surplus_value,
        width=width,
        friction_share=friction_share,
    )
    if problem.dwell is None or problem.objective == "mechanical":
        return [DurationInterval(parameters(**{problem.objective: 1.0}), t_min, t_max)]
    hold = prepared.holding_power(q_goal)
    return [
        DurationInterval(
            parameters(electrical=1.0, time=-float(piece.power)),
            max(t_min, piece.t_min),
            min(t_max, piece.t_max),
            float(piece.constant),
            goal_holding=_goal_holding(prepared, problem.dwell, float(hold), piece),
        )
        for piece in linear_dwells(problem.dwell, problem.arm, hold)
        if max(t_min, piece.t_min) <= min(t_max, piece.t_max)
    ]


def interval_around(
    prepared: PreparedProblem,
    q_goal: Array,
    duration: float,
    width: float = SMOOTHING.power_width,
) -> DurationInterval:
    """The interval of a problem that holds a duration [s], else the nearest one.

    `q_goal` and `width` are those of `duration_intervals`.
    """
    return min(
        duration_intervals(prepared, q_goal, width=width),
        key=lambda each: max(each.t_min - duration, duration - each.t_max, 0.0),
    )


def _goal_holding(
    prepared: PreparedProblem, dwell: Dwell, hold: float, piece: LinearDwell
) -> GoalHolding:
    first, last = (holding_times(dwell, T)[0] for T in (piece.t_min, piece.t_max))
    rate = (first - last) / (piece.t_max - piece.t_min)
    return GoalHolding(prepared.holding_power, hold, first + rate * piece.t_min, rate)


def fastest(prepared: PreparedProblem) -> DurationInterval:
    """The interval of all durations, with the duration as cost."""
    return DurationInterval(
        prepared.fastest_parameters, DURATIONS.least, DURATIONS.longest, minimum_time=True
    )
