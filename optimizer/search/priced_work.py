"""Lower bounds on mechanical work + price · duration, for many motions between few pairs of end
configurations.

A motion that takes less time and rests for what is left does the same work: a bound for the longest
duration of an interval holds for all of it. So the durations are cut into cells, each with the
bound on the work at its end and the price at its beginning, and the least of them is the bound.

What the ends alone say is that of `mechanical_bound`. Its bound by travel hangs on the potential
energies of both ends, the duration, and |Δq|_D: of the first two there are few, so the greatest
|Δq|_D is tabulated over the work for each of them, and looked up. The work is rounded down to the
table, so the bound stays true.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.mechanical_bound import EnergyRange, Swing, most_travel
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS

# cells of the durations, and works of the table, from this share of the greatest one on
CELLS, WORKS, LEAST_WORK = 40, 96, 1e-3


def priced_work_bounds(
    prepared: PreparedProblem,
    q_start: Array,
    q_goal: Array,
    potentials: Array,
    price: float,
    longest: float,
) -> Array:
    """Bounds (P,) [J] on work + price · duration of motions from q_start to q_goal (P, nq) [rad] of
    at most `longest` [s]; inf for those that take longer in any case.

    `potentials` (P, 2) [J] are the potential energies of start and goal; `price` [W] of time is not
    below 0.
    """
    arm, displacement = EnergyRange(prepared), q_goal - q_start
    limits, rotors = prepared.arm.active_limits, prepared.arm.drives.rotor_inertia
    shortest = np.maximum(shortest_duration(displacement, limits), DURATIONS.least)
    travel = np.sqrt(displacement**2 @ rotors)
    swing = Swing.of(arm, q_start, q_goal, potentials)
    ends, which = np.unique(np.column_stack([potentials, swing.least]), axis=0, return_inverse=True)
    bound = np.full(len(travel), np.inf)
    edges = (
        np.geomspace(min(float(shortest.min()), longest), longest, CELLS + 1)
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
    arm: EnergyRange, ends: Array, which: npt.NDArray[np.intp], travel: Array, duration: float
) -> Array:
    """The work (P,) [J] without which no motion of `duration` [s] travels |Δq|_D `travel` (P,).

    `ends` (e, 3) [J] are potential energies of start and goal, and the least one of all; `which`
    (P,) says whose.
    """
    work = np.empty(len(travel))
    shares = np.append(0.0, np.geomspace(LEAST_WORK, 1.0, WORKS))
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
        # the greatest energy of the table that is not enough
        enough = energies[np.maximum(np.searchsorted(reached, travel[own]) - 1, 0)]
        work[own] = 2 * enough - start - goal
    return work
