"""Bounds on the motions between two branches that turn joints otherwise than any candidate does.

Full turns of a joint that make a motion longer are no candidates without `windings`, and between
two poses beyond one turn (`candidates.pairs`). The plain lower bound grows with each joint's
displacement: so that of the candidates holds for them, too. A bound that is raised by more than the
displacements need not.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import SAME_TRAVEL, Candidate, joint_options


def bound_of_turns_left_out(prepared: PreparedProblem, candidate: Candidate) -> float:
    """The least plain bound [J] of motions between the candidate's branches with full turns that no
    candidate has; inf if there are none."""
    start, goal, windings = candidate.start, candidate.goal, prepared.problem.windings
    fixed = start.fixed or goal.fixed
    nearest, left_out = list[float](), list[float]()
    for starts, goals in zip(start.choices, goal.choices, strict=True):
        kept = [g - s for s, g in joint_options(starts, goals, fixed, windings)]
        every = [g - s for s, g in product(starts, goals)]
        others = [abs(d) for d in every if all(abs(d - each) > SAME_TRAVEL for each in kept)]
        nearest.append(min(map(abs, every)))
        left_out.append(min(others, default=np.inf))
    gain = prepared.potential(candidate.q_goal) - prepared.potential(candidate.q_start)
    bound = LeastBound(prepared).of_other_turns(
        np.array([nearest]), np.array([left_out]), np.array([gain])
    )
    return float(bound[0])
