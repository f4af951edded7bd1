"""Intervals of durations on which the objective of a candidate is smooth, with the kernel
parameters of each.

Without a dwell and without energy storage, one interval holds all durations, and the cost is the
objective. In a dwell, the energy of waiting is linear in the duration on either side of the instant
at which the brakes engage: one interval each, with an exact weight on time. The saving of an energy
storage depends on the charge over the whole motion: the cost values each joule of net surplus at
the constant `surplus_value`, and motions are compared by their exact energy.
"""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.dwell import LinearDwell, linear_dwells, waits
from joulepath.optimizer.dynamics.plant import WIDTH
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION
from joulepath.optimizer.solve.nlp.goal_holding import GoalHolding


@dataclass(frozen=True)
class DurationInterval:
    """Durations from t_min to t_max [s], packed kernel parameters p, and a constant part of the
    cost [J].

    `minimum_time`: the duration is the cost. `price` [W]: of time, beside the problem's own
    objective. `goal_holding`: in a dwell, what waiting at another goal draws beside.
    """

    p: Array
    t_min: float
    t_max: float
    constant: float = 0.0
    minimum_time: bool = False
    price: float = 0.0
    goal_holding: GoalHolding | None = None


def duration_intervals(
    prepared: PreparedProblem,
    q_goal: Array,
    surplus_value: float | None = None,
    width: float = WIDTH,
) -> list[DurationInterval]:
    """The intervals of a problem for motions that end at q_goal (nq,) [rad], in order of duration.

    `surplus_value` [1] is the value of a joule of net surplus with energy storage; None: the
    highest possible. `width` [W] smooths the corners of the cost.
    """
    problem = prepared.problem
    t_min = LEAST_DURATION if problem.duration_min is None else problem.duration_min
    t_max = LONGEST_DURATION if problem.duration_max is None else problem.duration_max
    if surplus_value is None and problem.arm.bus.mode == "storage":
        surplus_value = max(problem.arm.bus.efficiency, problem.arm.regeneration)
    if problem.dwell is None or problem.objective == "mechanical":
        weights = {problem.objective: 1.0}
        return [
            DurationInterval(
                prepared.parameters(**weights, regeneration=surplus_value, width=width),
                t_min,
                t_max,
            )
        ]
    hold = prepared.holding_power(q_goal)
    return [
        DurationInterval(
            prepared.parameters(
                electrical=1.0, time=-float(piece.power), regeneration=surplus_value, width=width
            ),
            max(t_min, piece.t_min),
            min(t_max, piece.t_max),
            float(piece.constant),
            goal_holding=_goal_holding(prepared, problem.dwell, float(hold), piece),
        )
        for piece in linear_dwells(problem.dwell, problem.arm, hold)
        if max(t_min, piece.t_min) <= min(t_max, piece.t_max)
    ]


def _goal_holding(
    prepared: PreparedProblem, dwell: Dwell, hold: float, piece: LinearDwell
) -> GoalHolding:
    first, last = (waits(dwell, T)[0] for T in (piece.t_min, piece.t_max))
    rate = (first - last) / (piece.t_max - piece.t_min)
    return GoalHolding(prepared.holding_power, hold, first + rate * piece.t_min, rate)


def fastest(prepared: PreparedProblem) -> DurationInterval:
    """All durations, with the duration as cost."""
    return DurationInterval(
        prepared.fastest_parameters, LEAST_DURATION, LONGEST_DURATION, minimum_time=True
    )
