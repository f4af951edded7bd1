"""Poses that the arm holds on a self-motion: how the best of their samples are refined.

Of a redundant arm, the posture is an unknown of the program, at either end. Of a singular one, it is at the goal, as in
`free_goal`. Else, and for methods that are not the free spline, the parameter of the self-motion moves in steps while
the energy decreases; each step is solved as a candidate of its own, and the steps are halved until they tell nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import Literal

import numpy as np

from models.robot import Array
from optimizer.kinematics.angles import nearest_turn, wrapped
from optimizer.kinematics.held_pose import HeldPose
from optimizer.kinematics.tcp import tcp_pose
from optimizer.methods.duration_intervals import duration_intervals
from optimizer.methods.free_spline import FreeSpline
from optimizer.methods.method import SolveResult
from optimizer.methods.sqp_method import Guess
from optimizer.search.attempts import in_time, settled, solve, solver_of
from optimizer.search.candidates import Candidate
from optimizer.search.ends import MEMBERS, EndConfiguration
from optimizer.search.free_goal import REFINED, refine_goal
from optimizer.search.incumbent import Incumbent
from optimizer.search.refinement import is_tight
from optimizer.search.sampled_ends import nearest_configuration, refine_best, with_ends
from optimizer.trajectories.bspline import Basis
from optimizer.trajectories.spline import sampled

# first step of a parameter, half the way between two samples on a whole circle, and the least one [rad]
FIRST_STEP, LEAST_STEP = np.pi / MEMBERS, 2e-3
# a posture farther from a curve is not on it [rad]
ON_CURVE = 1e-6

Side = Literal["start", "goal"]
SIDES: tuple[Side, Side] = ("start", "goal")


def refine(incumbent: Incumbent) -> list[Candidate]:
    """New candidates, found by moving the best solved samples along their self-motions.

    One sample per pair of branches is refined, at most MOST_REFINED of them; only candidates of less energy than their
    sample are returned.
    """
    solved = [each for each in incumbent.candidates if each.energy is not None and _sides(each)]
    return refine_best(
        solved,
        lambda each: (id(each.start.self_motion), id(each.goal.self_motion), each.start.label, each.goal.label),
        lambda each: _moved_along(incumbent, each),
    )


def polish(incumbent: Incumbent, best: Candidate) -> bool:
    """Refine the motion of the best candidate together with its posture; whether that found a better one."""
    if not _slides(incumbent, best):
        return False
    spline = best.spline
    fine = is_tight(incumbent, best)
    fresh = _slid(incumbent, best, lambda solver: solver.solve_from(*sampled(spline), fine))
    if fresh is None or (fresh.energy or 0.0) >= (best.energy or 0.0):
        return False
    incumbent.candidates.append(fresh)
    incumbent.tell_best()
    return True


def _moved_along(incumbent: Incumbent, candidate: Candidate) -> Candidate:
    """The candidate with its ends moved along their self-motions; itself if that never helps."""
    if not _slides(incumbent, candidate):
        sides = _sides(candidate)
        if incumbent.method is FreeSpline and "goal" in sides:
            candidate = refine_goal(incumbent, candidate)
            sides.remove("goal")
        return _descend(incumbent, candidate, sides)
    spline = candidate.spline
    guess = Guess(Basis.of(spline.knots / spline.duration), spline.control_points, spline.duration)
    fresh = _slid(incumbent, candidate, lambda solver: solver.improve(guess))
    return candidate if fresh is None or (fresh.energy or 0.0) >= (candidate.energy or 0.0) else fresh


def _slides(incumbent: Incumbent, candidate: Candidate) -> bool:
    """Whether the posture may be an unknown of the candidate's program."""
    redundant = incumbent.problem.arm.robot.nq > 6
    return redundant and incumbent.method is FreeSpline and len(_sides(candidate)) > 0


def _slid(incumbent: Incumbent, candidate: Candidate, attempt: Callable[[FreeSpline], SolveResult]) -> Candidate | None:
    """The candidate that an attempt finds whose ends slide along their self-motions; None if it finds none."""
    sides = _sides(candidate)
    spline = candidate.spline
    intervals = duration_intervals(incumbent.prepared, candidate.q_goal)
    interval = min(intervals, key=lambda each: max(each.t_min - spline.duration, spline.duration - each.t_max, 0.0))
    solver = solver_of(incumbent, candidate, interval)
    assert isinstance(solver, FreeSpline)
    if "start" in sides:
        solver.start_curve = _curve(incumbent, candidate.q_start)
    if "goal" in sides:
        solver.goal_curve = _curve(incumbent, candidate.q_goal)
    result = in_time(incumbent, partial(attempt, solver))
    if result.spline is None:
        return None
    q_start, q_goal = result.spline.control_points[[0, -1]]
    ends = [_end(incumbent, candidate, side, q) for side, q in zip(SIDES, (q_start, q_goal), strict=True)]
    if ends[0] is None or ends[1] is None:
        return None
    fresh = with_ends(incumbent.prepared, replace(candidate, start=ends[0], goal=ends[1]), q_start, q_goal)
    return None if fresh is None else settled(incumbent, fresh, result, REFINED)


def _curve(incumbent: Incumbent, q: Array) -> HeldPose:
    """The curve on which the arm holds the pose of q (nq,)."""
    arm = incumbent.problem.arm
    return HeldPose(arm, tcp_pose(arm, q), arm.active_limits.q_min, arm.active_limits.q_max)


def _end(incumbent: Incumbent, candidate: Candidate, side: Side, q: Array) -> EndConfiguration | None:
    """The end of the same target on whose self-motion q (nq,) is: where curves meet, it may be the next one.

    None if q is on no curve that the problem allows.
    """
    own: EndConfiguration = getattr(candidate, side)
    if own.self_motion is None:
        return own
    ends = {id(end): end for each in incumbent.candidates if (end := getattr(each, side)).target == own.target}
    nearest: dict[int, tuple[float, EndConfiguration]] = {}
    for end in ends.values():
        if end.self_motion is not None:
            away = float(np.abs(wrapped(end.q - q)).max())
            nearest[id(end.self_motion)] = min(
                nearest.get(id(end.self_motion), (np.inf, end)), (away, end), key=itemgetter(0)
            )
    for _, end in sorted(nearest.values(), key=itemgetter(0)):
        held = nearest_configuration(incumbent.prepared, end, q)
        if held is not None and np.abs(held - q).max() < ON_CURVE:
            return end
    return None


def _sides(candidate: Candidate) -> list[Side]:
    """The ends that a self-motion can move."""
    sides: list[Side] = []
    if candidate.start.self_motion is not None:
        sides.append("start")
    if candidate.goal.self_motion is not None:
        sides.append("goal")
    return sides


def _descend(incumbent: Incumbent, candidate: Candidate, sides: Sequence[Side]) -> Candidate:
    """The candidate of least energy found along the self-motions of these ends; itself if no step is better."""
    best, step = candidate, float(FIRST_STEP)
    while sides and step > LEAST_STEP and not incumbent.deadline.passed:
        steps = [(side, sign * step) for side in sides for sign in (1, -1)]
        tried = (_moved(incumbent, best, side, by) for side, by in steps)
        better = next(
            (each for each in tried if each is not None and (each.energy or 0.0) < (best.energy or 0.0)), None
        )
        if better is None:
            step /= 2
        else:
            best = better
    return best


def _moved(incumbent: Incumbent, candidate: Candidate, side: Side, step: float) -> Candidate | None:
    """The candidate with one end moved by `step` [rad] along its self-motion, solved; None if it has no motion."""
    if incumbent.deadline.passed:
        return None
    ends = {"start": (candidate.start, candidate.q_start), "goal": (candidate.goal, candidate.q_goal)}
    end, q = ends[side]
    motion = end.self_motion
    assert motion is not None
    member = motion.at(np.array([motion.clipped(motion.parameter(q) + step)]))[0]
    near = nearest_configuration(incumbent.prepared, end, nearest_turn(member, q))
    if near is None or (near == q).all():
        return None
    moved = {"start": candidate.q_start, "goal": candidate.q_goal, side: near}
    fresh = with_ends(incumbent.prepared, candidate, moved["start"], moved["goal"])
    if fresh is None or fresh.lower_bound >= (candidate.energy or 0.0):
        return None
    return settled(incumbent, fresh, solve(incumbent, fresh), REFINED)
