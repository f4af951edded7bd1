"""Bound on the motions between two branches with full turns omitted from the candidates.

Without `windings`, the candidates exclude longer motions by full turns and, between two poses,
displacements beyond one turn (`search.candidates.pairs`). The plain lower bound rises with the
displacement of every joint, so the bound of a candidate also holds for the omitted turns. A bound
raised by other means than the displacement does not necessarily hold for the omitted turns.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.kinematics.end_configuration import EQUAL_DISPLACEMENT, joint_options
from joulepath.optimizer.prepared_problem import PreparedProblem


def bound_of_omitted_turns(prepared: PreparedProblem, pair: Pair) -> float:
    """Least plain bound of motions between a pair's branches with omitted full turns [J].

    It is inf if no full turn is omitted.
    """
    start, goal, windings = pair.start, pair.goal, prepared.problem.windings
    fixed = start.fixed or goal.fixed
    nearest, omitted = list[float](), list[float]()
    for starts, goals in zip(start.choices, goal.choices, strict=True):
        kept = [g - s for s, g in joint_options(starts, goals, fixed, windings)]
        every = [g - s for s, g in product(starts, goals)]
        others = [abs(d) for d in every if all(abs(d - k) > EQUAL_DISPLACEMENT for k in kept)]
        nearest.append(min(map(abs, every)))
        omitted.append(min(others, default=np.inf))
    gain = prepared.potential(pair.q_goal) - prepared.potential(pair.q_start)
    bound = LeastBound(prepared).of_other_turns(
        np.array([nearest]), np.array([omitted]), np.array([gain])
    )
    return float(bound[0])
