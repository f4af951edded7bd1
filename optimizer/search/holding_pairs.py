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
from optimizer.search.turns_left_out import bound_of_turns_left_out

# times that a bound is raised at most, and the time [s] that it takes at most
MOST_RAISED, RAISING = 16, 0.1
# a bound is raised by this share of itself at most, then again: the higher it may become, the more durations have to
# share the cells
STEP = 0.2


def raise_bounds(prepared: PreparedProblem, candidates: Sequence[Candidate], deadline: Deadline) -> None:
    """Raise the lowest bound of the candidates, again and again, until it is one that cannot be raised further."""
    pairs = [each for each in candidates if not each.sampled]
    lowest = min(pairs, key=_bound_of, default=None)
    if lowest is None or np.isinf(lowest.lower_bound) or (cells := HoldingCells.of(prepared)) is None:
        return
    done = set[int]()
    for _ in range(MOST_RAISED):
        if id(lowest) in done or deadline.left < RAISING:
            return
        most = bound_of_turns_left_out(prepared, lowest)
        # a bound may be near zero: what is drawn at all times is a measure, too
        step = STEP * (abs(lowest.lower_bound) + prepared.arm.base_power * lowest.shortest)
        cap = min(lowest.lower_bound + step, most)
        gain = prepared.potential(lowest.q_goal) - prepared.potential(lowest.q_start)
        value = cells.pair(lowest.q_start, lowest.q_goal, gain, cap)
        if value < cap or value <= lowest.lower_bound:
            done.add(id(lowest))
        lowest.lower_bound = max(lowest.lower_bound, value)
        lowest = min(pairs, key=_bound_of)


def _bound_of(candidate: Candidate) -> float:
    return candidate.lower_bound
