"""Least mechanical work between ends that slide along self-motions, for one duration.

The work depends on the postures at both ends and on the route between the two postures. Solves that
started from straight lines between a few postures ended with up to 38 % too much work. A coarse
motion takes only some milliseconds (`BatchedMotions`). The search therefore optimises many coarse
motions, from straight lines and from random motions between many postures, and then solves the best
distinct motions with sliding ends.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.attempts import improve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.coarse_motions import COARSE, CoarseMotion, CoarseSolver
from joulepath.optimizer.search.least_work_settings import LEAST_WORK
from joulepath.optimizer.search.seeds import estimates, locally_least
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.search.state import SearchState


@dataclass(frozen=True)
class SlidingWorkSettings:
    """Settings of the search for least work between sliding ends."""

    straight: int = 36
    """Largest number of coarse motions from straight lines of locally least estimated work."""
    restarts: int = 96
    """Number of coarse motions from random guesses.

    The guesses connect random postures, because the best postures of straight lines led to more
    work.
    """
    estimate_ratio: float = 2.0
    """Largest ratio of a pair's estimated work to the least estimate at which it is drawn."""
    most_restarted: int = 600
    """Number of pairs of least estimate from which the pairs for random guesses are drawn."""
    progress: float = 1e-2
    """Smallest predicted relative decrease at which a coarse motion takes a further step."""
    most_solved: int = 6
    """Largest number of coarse motions solved with sliding ends."""
    work_ratio: float = 1.5
    """Largest ratio of a coarse motion's work to the least work at which the motion is solved.

    Sliding ends save up to a third of the work.
    """
    distance: float = 0.3
    """Largest difference of control points [rad] between two motions that count as equal."""
    seed: int = 0
    """Seed of the random pairs."""


SLIDING_WORK = SlidingWorkSettings()


def explore_sliding_work(state: SearchState) -> bool:
    """Find motions of least work between sliding ends, from coarse motions.

    The search runs at most once per request, under the conditions of `explore_least_work`, and only
    if an end slides.

    Args:
        state: state of the search; candidates with a motion are appended to its list.

    Returns:
        Whether a motion was found.
    """
    asked, prepared = state.problem, state.prepared
    plain = prepared.path is None and not asked.passes and asked.tool_path is None
    is_work = asked.objective == "mechanical" and asked.has_fixed_duration and plain
    in_time = state.deadline.left >= LEAST_WORK.least_time and prepared.kernel.compiled
    if state.sliding_work_sought or not (is_work and in_time):
        return False
    open_ = [
        each
        for each in state.candidates
        if each.status is CandidateStatus.UNVISITED and slides(prepared, each)
    ]
    if not open_:
        return False
    state.sliding_work_sought = True
    found = list[Candidate]()
    try:
        with watch(state.deadline):
            for motion in _of_other_kinds(_coarse(state, open_)):
                _solve(state, motion, found)
    except DeadlinePassed:
        state.cut_short = True
    return bool(found)


def _coarse(state: SearchState, candidates: Sequence[Candidate]) -> list[CoarseMotion]:
    """Coarse motions between many postures, in ascending order of their work."""
    settings, prepared = SLIDING_WORK, state.prepared
    solver = CoarseSolver(prepared, float(state.problem.duration_max or 0.0))
    energy = estimates(prepared, candidates)
    straight = solver.first(locally_least(candidates, energy)[: settings.straight])
    near = np.flatnonzero(energy <= settings.estimate_ratio * energy.min())
    near = near[np.argsort(energy[near], kind="stable")][: settings.most_restarted]
    drawn = np.random.default_rng(settings.seed).choice(near, settings.restarts)
    guesses = [*straight, *solver.random([candidates[k] for k in drawn.tolist()])]
    found = list[CoarseMotion]()
    for k in range(0, len(guesses), LEAST_WORK.batch):
        found += solver.solved(
            guesses[k : k + LEAST_WORK.batch],
            COARSE.control_points,
            SMOOTHING.power_width,
            settings.progress,
            LEAST_WORK.behind_ratio,
        )
    return sorted(found, key=lambda each: each.work)


def _of_other_kinds(found: Sequence[CoarseMotion]) -> Iterator[CoarseMotion]:
    """Distinct coarse motions worth a solve, from motions in ascending order of their work."""
    kept = list[CoarseMotion]()
    for each in found:
        too_much = each.work > SLIDING_WORK.work_ratio * found[0].work
        if too_much or len(kept) == SLIDING_WORK.most_solved:
            return
        if not any(_near(each.points, other.points) for other in kept):
            kept.append(each)
            yield each


def _near(points: np.ndarray, others: np.ndarray) -> bool:
    """Whether motions with the given control points (n, nq) [rad] count as equal."""
    return bool(np.abs(points - others).max() <= SLIDING_WORK.distance)


def _solve(state: SearchState, motion: CoarseMotion, found: list[Candidate]) -> None:
    """Solve a coarse motion with sliding ends, and append the solution as a new candidate.

    If several solutions count as equal, only the solution of least energy remains a candidate.
    """
    fresh, space = copy(motion.candidate), bspline.uniform(COARSE.control_points)
    points, duration = motion.points, float(state.problem.duration_max or 0.0)
    fresh.activate()
    improve(
        state,
        fresh,
        lambda solver: solver.solve_control_points(
            space, points, duration, LEAST_WORK.middle_progress
        ),
    )
    if fresh.energy is None:
        return
    for each in list(found):
        if _near(each.spline.control_points, fresh.spline.control_points):
            if (each.energy or 0.0) <= fresh.energy:
                return
            found.remove(each)
            state.candidates.remove(each)
    found.append(fresh)
    state.candidates.append(fresh)
    state.tell_tried(fresh)
