"""Another start for ends that slide: postures a step to each side of the one found.

A motion has several local optima, of energies that differ by some tenths of a percent, by which
limits it touches and when. An end that slides takes the motion along, so that both stay in the one
from which they began. A motion solved by itself to a posture beside may be in a better one; from
there both ends slide again.
"""

from __future__ import annotations

from functools import partial

from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.kinematics.tool_path.held_pose import HeldPose
from joulepath.optimizer.motion.spline import sampled
from joulepath.optimizer.search.attempts import improve, in_time, settled, solver_of
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.ends import SIDES
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.sampled_ends import with_ends
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.method import Method, above
from joulepath.optimizer.solve.methods.solve_result import SolveResult
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES
from joulepath.optimizer.solve.nlp.sqp_state import SQP

# length of the step along a curve [rad]
STEP = 0.15
# a solve is given up only if it is not expected to come below this multiple of the energy that it
# must come below: its first steps promise less than it finds
MARGIN = 1.003


def start_beside(incumbent: Incumbent, best: Candidate) -> Candidate:
    """The best solved candidate, or one that needs less, found from a posture beside; it is added
    to the candidates.

    Only motions of as few control points as the first solve has are compared, and only where no
    joint's power has a corner of its own: those are started again by `sharpening`.
    """
    prepared = incumbent.prepared
    cornered = has_corners(incumbent.problem.objective, prepared.arm)
    if cornered or not slides(prepared, best) or not incumbent.method.may_refine(best.spline):
        return best
    first = best
    for side in SIDES:
        if getattr(first, side).self_motion is None:
            continue
        q = {"start": first.q_start, "goal": first.q_goal}
        curve = HeldPose.of(prepared.arm, q[side])
        for step in (STEP, -STEP):
            beside = curve.put(q[side] + step * curve.tangent(q[side]))
            if beside is None or incumbent.deadline.passed:
                continue
            ends = q | {side: beside}
            fresh = with_ends(prepared, first, ends["start"], ends["goal"])
            if fresh is not None and _solved(incumbent, fresh, best.energy or 0.0):
                incumbent.candidates.append(fresh)
                best = fresh
    return best


def _solved(incumbent: Incumbent, candidate: Candidate, below: float) -> bool:
    """Solve a candidate as it is, and then with its ends sliding, if it needs less energy than
    `below` [J]; whether it does."""
    for interval in duration_intervals(incumbent.prepared, candidate.q_goal):
        solver = solver_of(incumbent, candidate, interval, above(below, MARGIN))
        result = in_time(incumbent, solver.solve)
        if result.spline is None or incumbent.prepared.cost_of(result.spline) >= below:
            continue
        settled(incumbent, candidate, result, result.message)
        improve(incumbent, candidate, partial(_again, result))
        return True
    return False


def _again(found: SolveResult, solver: Method) -> SolveResult:
    """Solve from a motion that was found with its ends fixed."""
    assert found.spline is not None
    q, t = sampled(found.spline)
    return solver.solve_evenly(q, t, SPLINE_SPACES.coarse_points, SQP.progress)
