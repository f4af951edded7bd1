"""Finer motions with sliding ends and knots at the switches of jerk.

The instants at which jerk switches depend on the posture at the ends. The first solve with knots at
the switches ends early, because the posture has moved by then. Further solves start from its
motion, with knots at the switches of the motion to the new posture.
"""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.search.attempts import improve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.state import SearchState


@dataclass(frozen=True)
class SwitchKnotSettings:
    """Settings of solves with knots at the switches of jerk."""

    first_progress: float = 1e-3
    """Relative decrease of the cost that a further step of a solve must promise."""
    most_repeats: int = 2
    """Largest number of further solves."""
    least_saving: float = 3e-3
    """Relative decrease of the energy below which no further solve follows: each solve saves some
    eighth of what the one before saved."""


SWITCH_KNOTS = SwitchKnotSettings()


def follow_switches(state: SearchState, candidate: Candidate) -> None:
    """Solve a candidate with knots at the switches of jerk, until the posture settles."""
    coarse = candidate.spline
    _solve_at_switches(state, candidate, coarse)
    if candidate.spline is coarse:
        return
    for _ in range(SWITCH_KNOTS.most_repeats):
        before = candidate.energy or 0.0
        if state.deadline.passed:
            return
        _solve_at_switches(state, candidate, candidate.spline)
        if before - (candidate.energy or 0.0) < SWITCH_KNOTS.least_saving * abs(before):
            return


def _solve_at_switches(state: SearchState, candidate: Candidate, spline: Spline) -> None:
    """Solve from a motion; knots at switches follow the posture."""
    progress = SWITCH_KNOTS.first_progress
    improve(state, candidate, lambda solver: solver.solve_at_switches(spline, progress))
