"""Poses that the arm holds on a self-motion: how the best of their samples are refined.

The posture at the goal is an unknown of the program, as in `free_goal`. At the start, the parameter of the self-motion
moves in steps while the energy decreases; each step is solved as a candidate of its own, and the steps are halved until
they tell nothing. So it does at the goal for methods that are not the free spline.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from optimizer.kinematics.angles import nearest_turn
from optimizer.methods.free_spline import FreeSpline
from optimizer.search.attempts import settled, solve, solve_from
from optimizer.search.candidates import Candidate
from optimizer.search.ends import MEMBERS
from optimizer.search.free_goal import REFINED, refine_goal
from optimizer.search.incumbent import Incumbent
from optimizer.search.refinement import is_tight
from optimizer.search.refinement import refine as refine_motion
from optimizer.search.sampled_ends import nearest_configuration, refine_best, with_ends
from optimizer.trajectories.spline import sampled

# first step of a parameter, half the way between two samples on a whole circle, and the least one [rad]
FIRST_STEP, LEAST_STEP = np.pi / MEMBERS, 2e-3
# of the energy, the least share that a coarse motion is taken to lose by refinement; coarse motions that are refined
# because they may then be better than the best one
SAVED, RIVALS = 0.01, 1
# rounds that move the goal of the refined motion
POSTURE_ROUNDS = 2

Side = Literal["start", "goal"]


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


def polish(incumbent: Incumbent, best: Candidate, coarse: float) -> None:
    """Refine samples that may be better than the best one, then the posture at the goal of the best motion.

    `coarse` [J] is the energy that the best candidate had before its motion was refined. Members that are next to each
    other need nearly the same energy, and what a coarse motion loses tells more than that.
    """
    if incumbent.method is not FreeSpline or best.energy is None or not _sides(best):
        return
    kept = 1 - max(SAVED, 2 * (1 - best.energy / coarse))
    others = [each for each in incumbent.candidates if each.energy is not None and each is not best and _sides(each)]
    for rival in sorted(others, key=lambda each: each.energy or 0.0)[:RIVALS]:
        if (rival.energy or 0.0) * kept < best.energy and not incumbent.deadline.passed:
            refine_motion(incumbent, rival)
    best = incumbent.best() or best
    if best.goal.self_motion is not None:
        fresh = refine_goal(incumbent, best, POSTURE_ROUNDS)
        if fresh is not best:
            incumbent.candidates.append(fresh)
            incumbent.tell_best()
        best = fresh
    if not incumbent.deadline.passed:
        # with knots at the switches of jerk in a motion of this duration
        solve_from(incumbent, best, sampled(best.spline), fine=is_tight(incumbent, best))


def _moved_along(incumbent: Incumbent, candidate: Candidate) -> Candidate:
    """The candidate with its ends moved along their self-motions; itself if that never helps."""
    sides = _sides(candidate)
    if incumbent.method is FreeSpline and "goal" in sides:
        candidate = refine_goal(incumbent, candidate)
        sides.remove("goal")
    return _descend(incumbent, candidate, sides)


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
