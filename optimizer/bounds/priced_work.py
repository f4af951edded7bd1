"""Lower bounds on mechanical work + price · duration, for many motions between few pairs of ends.

A motion does the same work if it takes less time and then rests. The bound on the work at the
longest duration of an interval therefore holds for the whole interval. The durations are divided
into cells. The bound of a cell is the bound on the work at its end plus the price of its
shortest duration, and the result is the least bound of all cells.

`mechanical_bound` bounds the work. Its bound by travel depends on the potential energies of both
ends, the duration, and |Δq|_D. The ends have few different energies, so the greatest |Δq|_D is
tabulated over the work once per pair of energies. The look-up rounds the work down to the table, so
the bound stays valid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.mechanical_bound import EnergyRange, Swing, most_travel
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class PricedWorkSettings:
    """Settings of the bounds on priced work."""

    cells: int = 40
    """Number of cells of the durations."""
    works: int = 96
    """Number of works in the table, beside zero."""
    least_work: float = 1e-3
    """Least work in the table, relative to the greatest."""


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
    arm, displacement = EnergyRange(prepared), q_goal - q_start
    limits, rotors = prepared.arm.active_limits, prepared.arm.drives.rotor_inertia
    shortest = np.maximum(shortest_duration(displacement, limits), DURATIONS.least)
    travel = np.sqrt(displacement**2 @ rotors)
    swing = Swing.of(arm, q_start, q_goal, potentials)
    ends, which = np.unique(np.column_stack([potentials, swing.least]), axis=0, return_inverse=True)
    bound = np.full(len(travel), np.inf)
    edges = (
        np.geomspace(min(float(shortest.min()), longest), longest, PRICED_WORK.cells + 1)
        if price > 0
        else np.full(2, longest)
    )
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        work = np.maximum(
            swing.variation(np.full(len(travel), end)), _by_travel(arm, ends, which, travel, end)
        )
        value = np.maximum(work - 4 * arm.rounding, 0.0) + price * np.maximum(shortest, begin)
        bound = np.where(shortest <= end, np.minimum(bound, value), bound)
    return np.where(shortest > longest, np.inf, bound)


def _by_travel(
    arm: EnergyRange, ends: Array, which: Indices, travel: Array, duration: float
) -> Array:
    """Least work of motions of a duration with given travels, shape (P,) [J].

    Args:
        arm: bounds on the energy of the arm.
        ends: potential energies of start and goal, and least of all, shape (e, 3) [J].
        which: row in `ends` of each motion, shape (P,).
        travel: |Δq|_D, shape (P,).
        duration: duration [s].
    """
    work = np.empty(len(travel))
    shares = np.append(0.0, np.geomspace(PRICED_WORK.least_work, 1.0, PRICED_WORK.works))
    for k, (start, goal, least) in enumerate(ends.tolist()):
        own = which == k
        both = np.array([[start, goal]])
        top, potential, fastest = (
            max(start, goal),
            *arm.fall(both, np.array([least]), np.array([duration])),
        )
        span = float(potential.max()) - top + 2 * (float(travel[own].max()) / duration) ** 2
        energies = top + max(span, 0.0) * shares
        reached = most_travel(potential, fastest, energies[:, None], duration)
        # the greatest tabulated energy with too little travel
        enough = energies[np.maximum(np.searchsorted(reached, travel[own]) - 1, 0)]
        work[own] = 2 * enough - start - goal
    return work
