"""Lower bounds of pairs, raised by the copper loss of holding against gravity: `bounds.holding`.

The plain bound leaves that loss out: a quarter of the gap of heavy arms. A pair takes a few milliseconds, so that only
those whose bounds would be the answer's are raised, the lowest first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optimizer.deadline import Deadline
from optimizer.prepared_problem import PreparedProblem
from optimizer.search.candidates import Candidate
from optimizer.search.holding_cells import HoldingCells

# times that a bound is raised at most, and the time [s] that it takes at most
MOST_RAISED, RAISING = 16, 0.1
# a bound is raised by this share of itself at most, then again: the higher it may become, the more durations have to
# share the cells
STEP = 0.2


def hold(prepared: PreparedProblem, candidates: Sequence[Candidate], deadline: Deadline) -> None:
    """Raise the least of the lower bounds of candidates, until the least one has been raised as far as it can be."""
    pairs = [each for each in candidates if not each.sampled and each.goal.tolerance is None]
    lowest = min(pairs, key=_bound_of, default=None)
    if lowest is None or np.isinf(lowest.lower_bound) or (cells := HoldingCells.of(prepared)) is None:
        return
    done = set[int]()
    for _ in range(MOST_RAISED):
        if id(lowest) in done or deadline.left < RAISING:
            return
        # a bound may be near zero: what is drawn at all times is a measure, too
        cap = lowest.lower_bound + STEP * (abs(lowest.lower_bound) + prepared.arm.base_power * lowest.shortest)
        gain = prepared.potential(lowest.q_goal) - prepared.potential(lowest.q_start)
        value = cells.pair(lowest.q_start, lowest.q_goal, gain, cap)
        lowest.lower_bound = max(lowest.lower_bound, value)
        if value < cap:
            done.add(id(lowest))
        lowest = min(pairs, key=_bound_of)


def _bound_of(candidate: Candidate) -> float:
    return candidate.lower_bound
