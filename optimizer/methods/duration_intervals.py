"""Over which durations, and by which kernel parameters, a candidate's objective is a smooth cost.

Without a cycle and without a store, one interval holds all durations, and the cost is the objective itself. Waiting is
linear in the duration on either side of the instant at which brakes would be on: a interval each, in which it is a
weight
on time, exactly. What a store saves depends on the whole course of its charge: there the cost takes every joule of net
surplus to be worth `surplus_value`, and what it finds is judged by the exact energy.
"""

from __future__ import annotations

from dataclasses import dataclass

from models.robot import Array
from optimizer.energy.dwell import linear_dwells
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION


@dataclass(frozen=True)
class DurationInterval:
    """Durations [s], packed kernel parameters, and a constant part of the cost [J]; `minimum_time`: time is the
    cost."""

    p: Array
    t_min: float
    t_max: float
    constant: float = 0.0
    minimum_time: bool = False


def duration_intervals(
    prepared: PreparedProblem, q_goal: Array, surplus_value: float | None = None
) -> list[DurationInterval]:
    """The duration_intervals of a problem for motions that end at q_goal (nq,), in order of duration."""
    problem = prepared.problem
    t_min = LEAST_DURATION if problem.duration_min is None else problem.duration_min
    t_max = LONGEST_DURATION if problem.duration_max is None else problem.duration_max
    if surplus_value is None and problem.arm.bus.mode == "storage":
        surplus_value = max(problem.arm.bus.efficiency, problem.arm.regeneration)
    if problem.cycle is None or problem.objective == "mechanical":
        return [
            DurationInterval(prepared.parameters(**{problem.objective: 1.0}, regeneration=surplus_value), t_min, t_max)
        ]
    return [
        DurationInterval(
            prepared.parameters(electrical=1.0, time=-float(piece.power), regeneration=surplus_value),
            max(t_min, piece.t_min),
            min(t_max, piece.t_max),
            float(piece.constant),
        )
        for piece in linear_dwells(problem.cycle, problem.arm, prepared.holding_power(q_goal))
        if max(t_min, piece.t_min) <= min(t_max, piece.t_max)
    ]


def fastest(prepared: PreparedProblem) -> DurationInterval:
    """All durations, and the duration as the cost."""
    return DurationInterval(prepared.fastest_parameters, LEAST_DURATION, LONGEST_DURATION, minimum_time=True)
