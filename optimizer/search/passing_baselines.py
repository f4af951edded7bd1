"""Baselines of a motion through passes, which rest at each pass."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np

from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.motion.passing import pass_times
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.search.baselines import baselines


def stopping_baselines(prepared: PreparedProblem, spline: Spline, ours: float) -> list[Baseline]:
    """Baselines that rest at each pass, every part in the time that our motion takes for it.

    A baseline without some part is left out.

    Args:
        prepared: the problem.
        spline: our motion.
        ours: its objective [J].
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
    """One baseline from the baselines of the parts."""
    electrical, mechanical = (
        sum(each.electrical for each in parts),
        sum(each.mechanical for each in parts),
    )
    known = [each.sensitivity for each in parts if each.sensitivity is not None]
    return replace(
        parts[-1],
        duration=sum(each.duration for each in parts),
        electrical=electrical,
        mechanical=mechanical,
        saving=saving(ours, electrical if problem.objective == "electrical" else mechanical),
        reason="; ".join(dict.fromkeys(each.reason for each in parts if each.reason)) or None,
        sensitivity=reduce(add, known) if len(known) == len(parts) else None,
    )
