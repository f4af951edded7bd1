"""A motion through passes: what it needs at least, and the baselines that rest at each of them."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import travel_bounds
from joulepath.optimizer.motion.passing import pass_times
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.result.solution import Baseline
from joulepath.optimizer.search.baselines import baselines, saving


def bound_through(prepared: PreparedProblem, q_start: Array, q_goal: Array) -> float:
    """Lower bound [J] on the objective of all motions from q_start through the passes to q_goal
    (nq,) [rad].
    """
    problem = prepared.problem
    if problem.objective == "mechanical" or problem.dwell is not None:
        return -np.inf
    q = np.array([q_start, *problem.passes, q_goal])
    gains = np.diff([prepared.potential(each) for each in q])
    longest = DURATIONS.longest if problem.duration_max is None else problem.duration_max
    return float(travel_bounds(prepared, np.diff(q, axis=0), gains, longest=longest).sum())


def stopping_baselines(prepared: PreparedProblem, spline: Spline, ours: float) -> list[Baseline]:
    """The baselines from rest to rest, one after the other, each part in the time that our motion
    takes for it.

    `ours` [J] is our objective. A baseline that some part does not have is left out.
    """
    problem: Problem = replace(prepared.problem, passes=(), dwell=None)
    q = np.array([spline.control_points[0], *prepared.problem.passes, spline.control_points[-1]])
    times = [0.0, *pass_times(spline.curve, q[1:-1]).tolist(), spline.duration]
    oracle = prepared.torques, prepared.potential, prepared.broken_on_the_way
    parts = [
        {
            each.name: each
            for each in baselines(
                problem, a, b[None], max(end - begin, DURATIONS.least), ours, *oracle
            )
        }
        for (a, b), (begin, end) in zip(pairwise(q), pairwise(times), strict=True)
    ]
    tables = [
        [part[name] for part in parts] for name in parts[0] if all(name in part for part in parts)
    ]
    return [_joined(problem, table, ours) for table in tables]


def _joined(problem: Problem, parts: list[Baseline], ours: float) -> Baseline:
    """One baseline of those of the parts."""
    electrical, mechanical = (
        sum(each.electrical for each in parts),
        sum(each.mechanical for each in parts),
    )
    return replace(
        parts[-1],
        duration=sum(each.duration for each in parts),
        electrical=electrical,
        mechanical=mechanical,
        saving=saving(ours, electrical if problem.objective == "electrical" else mechanical),
        reason="; ".join(dict.fromkeys(each.reason for each in parts if each.reason)) or None,
        sensitivity=reduce(add, [each.sensitivity for each in parts]),
    )
