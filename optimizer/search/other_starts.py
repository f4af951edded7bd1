"""Further starts for motions with an end on a self-motion: postures beside the best posture.

A motion has several local optima. They differ in the set of active limits and in the times of
contact, and their energies by some tenths of a percent. Optimisation along the self-motion deforms
the motion continuously and therefore stays in the initial basin. A fresh solve to an adjacent
posture may reach a better optimum; both ends are then optimised along their self-motions again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.motion.spline import sampled
from joulepath.optimizer.search.attempts import improve, in_time, settled, solver_of
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.ends import SIDES
from joulepath.optimizer.search.sampled_ends import with_ends
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.method import Method, above
from joulepath.optimizer.solve.methods.solve_result import MotionOrigin, SolveResult
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES
from joulepath.optimizer.solve.nlp.sqp_state import SQP


@dataclass(frozen=True)
class OtherStartSettings:
    """Settings of the search from other initial guesses."""

    step: float = 0.15
    """Length of the step along a curve [rad]."""
    promise_margin: float = 1.003
    """Factor on the energy that a solve must promise to come below, since its first steps promise
    less than it finds."""


OTHER_STARTS = OtherStartSettings()


def start_beside(state: SearchState, best: Candidate) -> Candidate:
    """Search for a better candidate from postures one step along the self-motions of the ends.

    Motions with more control points than in the first solve are left out. So are motions with
    corners in the powers of joints, because `sharpening` restarts them itself, and motions from
    planned paths: planning anew took a tenth of the time, and saved 0.02 % of the energy.

    Args:
        state: state of the search; better candidates are appended to its list.
        best: the solved candidate of least energy.

    Returns:
        The candidate of least energy, `best` if no other start improves on it.
    """
    prepared = state.prepared
    cornered = has_corners(state.problem.objective, prepared.arm)
    planned = best.attempt is not None and best.attempt.origin is MotionOrigin.FROM_PLANNED_PATH
    if (
        cornered
        or planned
        or not slides(prepared, best)
        or not state.method.may_refine(best.spline)
    ):
        return best
    first = best
    for side in SIDES:
        if getattr(first, side).self_motion is None:
            continue
        q = {"start": first.q_start, "goal": first.q_goal}
        curve = HeldPose.of(prepared.arm, q[side])
        for step in (OTHER_STARTS.step, -OTHER_STARTS.step):
            beside = curve.put(q[side] + step * curve.tangent(q[side]))
            if beside is None or state.deadline.passed:
                continue
            ends = q | {side: beside}
            fresh = with_ends(prepared, first, ends["start"], ends["goal"])
            if fresh is not None and _solved(state, fresh, best.energy or 0.0):
                state.candidates.append(fresh)
                best = fresh
    return best


def _solved(state: SearchState, candidate: Candidate, below: float) -> bool:
    """Solve a candidate with fixed ends and, if its energy is below `below`, with sliding ends.

    Args:
        state: state of the search.
        candidate: the candidate; receives the solution.
        below: energy of the incumbent [J].

    Returns:
        Whether the energy of the candidate is below `below`.
    """
    for interval in duration_intervals(state.prepared, candidate.q_goal):
        solver = solver_of(state, candidate, interval, above(below, OTHER_STARTS.promise_margin))
        result = in_time(state, solver.solve)
        if result.spline is None or state.prepared.cost_of(result.spline) >= below:
            continue
        settled(state, candidate, result, result.message)
        improve(state, candidate, partial(_again, result))
        return True
    return False


def _again(found: SolveResult, solver: Method) -> SolveResult:
    """Solve from a motion with fixed ends."""
    assert found.spline is not None
    q, t = sampled(found.spline)
    return solver.solve_evenly(q, t, SPLINE_SPACES.coarse_points, SQP.progress)
