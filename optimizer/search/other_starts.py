"""Other starts for sliding ends: postures one step to each side of the best posture.

A motion has several local optima, which differ in the limits that it touches and in their times, by
some tenths of a percent of energy. An end that slides takes the motion along, so both stay in the
optimum from which they began. A motion solved by itself to a posture beside may be in a better
optimum; from there both ends slide again.
"""

from __future__ import annotations

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
from joulepath.optimizer.solve.methods.solve_result import SolveResult
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES
from joulepath.optimizer.solve.nlp.sqp_state import SQP

STEP_LENGTH = 0.15
"""Length of the step along a curve [rad]."""
PROMISE_MARGIN = 1.003
"""Factor on the energy that a solve must promise to come below, since its first steps promise less
than it finds."""


def start_beside(state: SearchState, best: Candidate) -> Candidate:
    """The best solved candidate, or a better candidate found from a posture beside, which is
    appended.

    Motions with more control points than the first solve are left out, and motions with corners in
    joints' powers, which `sharpening` starts again.
    """
    prepared = state.prepared
    cornered = has_corners(state.problem.objective, prepared.arm)
    if cornered or not slides(prepared, best) or not state.method.may_refine(best.spline):
        return best
    first = best
    for side in SIDES:
        if getattr(first, side).self_motion is None:
            continue
        q = {"start": first.q_start, "goal": first.q_goal}
        curve = HeldPose.of(prepared.arm, q[side])
        for step in (STEP_LENGTH, -STEP_LENGTH):
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
    """Solve a candidate with fixed ends, then with sliding ends if it needs less than `below` [J].

    Returns:
        Whether it needs less.
    """
    for interval in duration_intervals(state.prepared, candidate.q_goal):
        solver = solver_of(state, candidate, interval, above(below, PROMISE_MARGIN))
        result = in_time(state, solver.solve)
        if result.spline is None or state.prepared.cost_of(result.spline) >= below:
            continue
        settled(state, candidate, result, result.message)
        improve(state, candidate, partial(_again, result))
        return True
    return False


def _again(found: SolveResult, solver: Method) -> SolveResult:
    """Solve from a motion that was found with fixed ends."""
    assert found.spline is not None
    q, t = sampled(found.spline)
    return solver.solve_evenly(q, t, SPLINE_SPACES.coarse_points, SQP.progress)
