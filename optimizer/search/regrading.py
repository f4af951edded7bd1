"""Finer motions whose ends slide: where jerk switches depends on the posture that is found, so the
knots follow it.

The first solve with knots at the switches of jerk ends early, since the posture has moved by then.
Each further one begins from its motion, with the knots at the switches of the motion to the posture
found.
"""

from __future__ import annotations

from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.search.attempts import improve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.incumbent import Incumbent

# relative decrease of the cost that a further step of the first solve must promise
FIRST_PROGRESS = 1e-3
# further solves, while each saves this share of the energy
REGRADED, SAVED = 2, 1e-3


def grade(incumbent: Incumbent, candidate: Candidate) -> None:
    """Solve again with knots at the switches of jerk, and then at those of the motion to the
    posture found.
    """
    coarse = candidate.spline
    _solve_from(incumbent, candidate, coarse)
    if candidate.spline is coarse:
        return
    for _ in range(REGRADED):
        before = candidate.energy or 0.0
        if incumbent.deadline.passed:
            return
        _solve_from(incumbent, candidate, candidate.spline)
        if before - (candidate.energy or 0.0) < SAVED * abs(before):
            return


def _solve_from(incumbent: Incumbent, candidate: Candidate, spline: Spline) -> None:
    """Solve from a motion, of which the knots follow the posture if they are at switches
    already."""
    improve(incumbent, candidate, lambda solver: solver.solve_at_switches(spline, FIRST_PROGRESS))
