"""Refinement of the best samples on self-motions, for ends that do not slide.

The posture at the goal of a singular arm is an unknown of the program, as in `free_goal`. At the
start, and for methods other than the free spline, the parameter of the self-motion moves in steps
while the energy decreases. Each step is solved as a candidate of its own, and steps are halved
until they no longer matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.problem.targets import Side
from joulepath.optimizer.search.attempts import settled, solve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.ends import SAMPLING
from joulepath.optimizer.search.free_goal import REFINED, refine_goal
from joulepath.optimizer.search.sampled_ends import nearest_configuration, refine_best, with_ends
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.search.state import SearchState


@dataclass(frozen=True)
class SelfMotionSettings:
    """Settings of the search along self-motions."""

    first_step: float = np.pi / SAMPLING.members
    """First step of a parameter [rad]: half the distance of two samples on a whole circle."""
    least_step: float = 2e-3
    """Least step of a parameter [rad]."""


SELF_MOTIONS = SelfMotionSettings()


def refine(state: SearchState) -> list[Candidate]:
    """New candidates, found by moving the best solved samples along their self-motions.

    One sample per pair of branches is refined. Only candidates of less energy than their sample are
    returned.
    """
    prepared = state.prepared
    solved = [
        each
        for each in state.candidates
        if each.energy is not None and _sides(each) and not slides(prepared, each)
    ]
    return refine_best(
        solved,
        lambda each: (
            each.start.self_motion,
            each.goal.self_motion,
            each.start.label,
            each.goal.label,
        ),
        lambda each: _moved_along(state, each),
    )


def _moved_along(state: SearchState, candidate: Candidate) -> Candidate:
    """The candidate with its ends moved along their self-motions; itself if no step is better."""
    sides = _sides(candidate)
    if state.method.free_control_points and "goal" in sides:
        candidate = refine_goal(state, candidate)
        sides.remove("goal")
    return _descend(state, candidate, sides)


def _sides(candidate: Candidate) -> list[Side]:
    """The ends on self-motions."""
    sides: list[Side] = []
    if candidate.start.self_motion is not None:
        sides.append("start")
    if candidate.goal.self_motion is not None:
        sides.append("goal")
    return sides


def _descend(state: SearchState, candidate: Candidate, sides: Sequence[Side]) -> Candidate:
    """The candidate of least energy found along the self-motions of some ends, by a pattern search.

    It is the candidate itself if no step is better.
    """
    best, step = candidate, SELF_MOTIONS.first_step
    while sides and step > SELF_MOTIONS.least_step and not state.deadline.passed:
        steps = [(side, sign * step) for side in sides for sign in (1, -1)]
        tried = (_moved(state, best, side, by) for side, by in steps)
        better = next(
            (
                each
                for each in tried
                if each is not None and (each.energy or 0.0) < (best.energy or 0.0)
            ),
            None,
        )
        if better is None:
            step /= 2
        else:
            best = better
    return best


def _moved(state: SearchState, candidate: Candidate, side: Side, step: float) -> Candidate | None:
    """The candidate with one end moved by a step [rad] along its self-motion, solved; None if it
    fails.
    """
    if state.deadline.passed:
        return None
    ends = {
        "start": (candidate.start, candidate.q_start),
        "goal": (candidate.goal, candidate.q_goal),
    }
    end, q = ends[side]
    motion = end.self_motion
    assert motion is not None
    member = motion.at(np.array([motion.clipped(motion.parameter(q) + step)]))[0]
    near = nearest_configuration(state.prepared, end, nearest_turn(member, q))
    if near is None or (near == q).all():
        return None
    moved = {"start": candidate.q_start, "goal": candidate.q_goal, side: near}
    fresh = with_ends(state.prepared, candidate, moved["start"], moved["goal"])
    if fresh is None or fresh.lower_bound >= (candidate.energy or 0.0):
        return None
    return settled(state, fresh, solve(state, fresh), REFINED)
