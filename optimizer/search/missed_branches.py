"""What can be said of branches that an inverse kinematics may have missed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optimizer.kinematics.wrist_geometry import potential_rates
from optimizer.prepared_problem import PreparedProblem
from optimizer.search.candidates import Candidate
from optimizer.search.lower_bound import LeastBound


def all_known(candidates: Sequence[Candidate]) -> bool:
    """Whether every branch of every target is among the candidates."""
    return all(each.start.complete and each.goal.complete for each in candidates)


def bound_of_missed(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> float:
    """Lower bound [J] on the motions from or to branches that may have been missed; inf if all are known.

    It is that of the motions between any two configurations, whatever the targets.

    Between two configurations no joint need move. But for full turns, which change no potential energy, they differ by
    at most half a turn in each joint: the potential energy falls by at most its greatest rate over that.
    """
    if all_known(candidates):
        return np.inf
    fall = np.pi * float(potential_rates(prepared.model, prepared.arm.gravity).sum())
    return float(LeastBound(prepared).of(np.zeros((1, prepared.arm.robot.nq)), np.array([-fall]))[0])
