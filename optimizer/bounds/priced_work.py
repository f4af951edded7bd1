"""Lower bounds on mechanical work + price · duration.

A motion does the same work if it takes less time and then rests. The bound on the work at the
longest duration of an interval therefore holds for the whole interval. The durations are divided
into cells. The bound of a cell is the bound on the work at its end plus the price of its
shortest duration, and the result is the least bound of all cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.mechanical_bound import EnergyRange, Swing
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class PricedWorkSettings:
    """Settings of the bounds on priced work."""

    cells: int = 40
    """Number of cells of the durations."""


PRICED_WORK = PricedWorkSettings()


def priced_work_bounds(
    prepared: PreparedProblem,
    q_start: Array,
    q_goal: Array,
    potentials: Array,
    price: float,
    longest: float,
) -> Array:
    """Lower bounds on work + price · duration.

    Args:
        prepared: problem of the motions.
        q_start: start configurations, shape (P, nq) [rad].
        q_goal: goal configurations, shape (P, nq) [rad].
        potentials: potential energies of start and goal, shape (P, 2) [J].
        price: price of time, at least 0 [W].
        longest: longest duration [s].

    Returns:
        Bounds, shape (P,) [J]; inf for a motion whose shortest duration exceeds `longest`.
    """
    limits = prepared.arm.active_limits
    shortest = np.maximum(shortest_duration(q_goal - q_start, limits), DURATIONS.least)
    swing = Swing.of(EnergyRange(prepared), q_start, q_goal, potentials)
    bound = np.full(len(shortest), np.inf)
    edges = (
        np.geomspace(min(float(shortest.min()), longest), longest, PRICED_WORK.cells + 1)
        if price > 0
        else np.full(2, longest)
    )
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        work = swing.least_work(np.full(len(shortest), end))
        value = work + price * np.maximum(shortest, begin)
        bound = np.where(shortest <= end, np.minimum(bound, value), bound)
    return np.where(shortest > longest, np.inf, bound)
