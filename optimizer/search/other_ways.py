"""Other ways around obstacles to the postures that hold a pose, for mechanical work.

The seeds of a redundant arm are chosen by straight lines in joints. Lines through obstacles say
little about the work of the ways around them. Planned paths to the quickest posture on every
self-motion, and to others apart from it, are therefore initial guesses, too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import zip_longest
from operator import methodcaller

import numpy as np

from joulepath.optimizer.collision.planner.joint_path import path_samples
from joulepath.optimizer.collision.planner.path_planner import Effort
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.search.attempts import improve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.search.state import SearchState


@dataclass(frozen=True)
class OtherWaysSettings:
    """Settings of the search along planned paths to other postures."""

    slack: float = 0.95
    """Largest ratio of a posture's shortest duration to the longest allowed one: faster motions do
    much work, and take long to find."""
    postures: int = 3
    """Number of postures on every pair of self-motions to which paths are planned. With one, the
    work was 1 % more in the mean of 21 scenes, up to 10 % in one, and never less."""
    separation: float = 0.4
    """Least displacement [rad] of some joint between these postures."""
    effort: Effort = field(default_factory=lambda: Effort(most_states=4_000))
    """Effort of a planning, which takes some 30 ms; the solves from its paths take 0.1 s each."""
    time_share: float = 0.2
    """Share of the time left that the search may take."""


OTHER_WAYS = OtherWaysSettings()


def explore_other_ways(state: SearchState) -> None:
    """Solve candidates along planned paths, and accept motions of less energy.

    It does nothing without a motion or obstacles, and for ends that do not slide.
    """
    best, problem = state.best(), state.problem
    if (
        best is None
        or problem.objective != "mechanical"
        or not problem.arm.scene.names
        or not slides(state.prepared, best)
    ):
        return
    end, state.end = state.end, state.end.within(OTHER_WAYS.time_share * state.deadline.left)
    for candidate in quickest(state):
        if not state.deadline.passed:
            _solve_along_paths(state, candidate)
    state.end = end


def quickest(state: SearchState) -> list[Candidate]:
    """Separate candidates of least shortest duration of every pair of self-motions.

    The quickest candidates of all pairs come first.
    """
    longest = OTHER_WAYS.slack * (state.problem.duration_max or np.inf)
    found: dict[tuple[SelfMotion | None, SelfMotion | None], list[Candidate]] = {}
    for each in sorted(state.candidates, key=lambda each: each.shortest):
        if each.holdable and each.shortest <= longest:
            of_pair = found.setdefault((each.start.self_motion, each.goal.self_motion), [])
            if len(of_pair) < OTHER_WAYS.postures and all(
                _distance(each, other) > OTHER_WAYS.separation for other in of_pair
            ):
                of_pair.append(each)
    ranks = zip_longest(*found.values())
    return [each for rank in ranks for each in rank if each is not None]


def _distance(first: Candidate, second: Candidate) -> float:
    """Greatest displacement of a joint [rad] between the ends of two candidates."""
    return max(
        float(np.abs(first.q_start - second.q_start).max()),
        float(np.abs(first.q_goal - second.q_goal).max()),
    )


def _solve_along_paths(state: SearchState, candidate: Candidate) -> None:
    """Solve a candidate from planned paths to its goal."""
    planned = state.prepared.surroundings.planned_paths(
        candidate.q_start, candidate.q_goal, state.deadline, effort=OTHER_WAYS.effort
    )
    for path in planned.ending_at(candidate.q_goal):
        q, t = path_samples(path, 1.0, state.problem.arm.active_limits.v_max)
        improve(state, candidate, methodcaller("along_path", q, t))
    candidate.deferred &= candidate.energy is None
