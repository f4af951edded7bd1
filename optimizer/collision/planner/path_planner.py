"""Collision-free joint paths between configurations: initial guesses for the optimiser.

Several searches by RRT-Connect (see `path_search`) alternate in short slices, each in its own box
of configurations: the first search with a path, and its effort, differ from task to task.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from ompl import util as ou

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.collision.planner.joint_path import is_same_path, path_length
from joulepath.optimizer.collision.planner.path_search import (
    PATH_SEARCH,
    Box,
    PathSearch,
    joint_weights,
)
from joulepath.optimizer.collision.planner.planning_result import PlannedPaths, PlanningEnd
from joulepath.optimizer.collision.planner.state_validity import ValidityCheckers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class PlannerSettings:
    """Settings of the path planner."""

    reserves: tuple[float, ...] = (5e-3, 5e-4, 0.0)
    """Clearances [m] of a path beyond the margins; the first one that start and a goal have is
    used.
    """
    step: float = 0.1
    """Distance [rad] between checked states of an edge, in weighted joints. It is halved in a
    region after a collision of a path found there.
    """
    max_states: int = 200_000
    """Largest number of checked states of a planning, over all its searches."""
    template_states: int = 5_000
    """Largest number of checked states of a planning with a template path."""
    lock_poll: float = 0.02
    """Time [s] between two checks of the deadline by a thread that waits for the planner."""


PLANNER = PlannerSettings()


_OMPL = threading.Lock()
"""Lock held from the seed to the last shortcut: all planners, samplers and simplifiers of OMPL draw
their seeds from one generator of the process, so two threads at once would take seeds from each
other. The loss is small, since planners spend their time in validity checks, and these need
Python's global lock.
"""


@dataclass(frozen=True)
class Effort:
    """Effort of a planning."""

    most_states: int = PLANNER.max_states
    """Largest number of states checked by all searches."""
    paths: int = 2
    """Number of different paths sought."""
    more_states: int = 3_000
    """States that may be checked for further paths after the first path."""
    easy: int = 0
    """Number of states below which a planning counts as easy: `paths` and `more_states` are then
    those of USUAL_EFFORT.
    """


USUAL_EFFORT = Effort()


@dataclass(frozen=True)
class SampledBox:
    """Box of configurations that a search samples: `margin` [rad] beyond the range of start and
    goals, within the joint limits.

    The search gets slices of `states` checked states while the states checked by all searches are
    between `after` and `before`. A `narrow` region is for narrow gaps, with half of the step and a
    smaller reserve.
    """

    margin: float
    states: int
    after: float = 0
    before: float = np.inf
    narrow: bool = False


REGIONS = (
    SampledBox(0.7, 400, before=4_000),
    SampledBox(2.2, 1_600),
    SampledBox(2.2, 800, 20_000, narrow=True),
    SampledBox(3.5, 800, 20_000),
)
"""Regions of the searches. Narrow bounds give short paths, if any; wide bounds contain ways out of
a cage. No margin allows a needless full turn of a joint. The last searches are for gaps that the
reserve or the step closes.
"""


def plan_paths(
    arm: Arm,
    q_start: Array,
    q_goals: Array,
    deadline: Deadline,
    effort: Effort = USUAL_EFFORT,
    seed: int = 1,
    checkers: ValidityCheckers | None = None,
    template: Array | None = None,
) -> PlannedPaths:
    """Collision-free joint paths from a start to any of several goals.

    A path is piecewise linear, within the joint limits and the tool cone of the arm. It is checked
    at short steps, which is no proof. Unless the deadline passes, `seed` determines the result.

    Args:
        arm: the arm.
        q_start: start (nq,) [rad].
        q_goals: goals, (nq,) or (m, nq) [rad].
        deadline: time at which the planning ends at the latest.
        effort: approximate limit of the checked states.
        seed: seed of the random numbers.
        checkers: validity checkers of the arm, if they exist already.
        template: path (k, nq) [rad] to a goal that differs by full turns. Then one path is sought,
            and it may follow the template away from the start and, shifted by the turns, to the
            goal: narrow exits from an obstacle are found only once.
    """
    checkers = ValidityCheckers(arm, collision_model(arm)) if checkers is None else checkers
    if template is not None:
        effort = Effort(min(effort.most_states, PLANNER.template_states), paths=1)
    reserves = _reserves(checkers, q_start, np.atleast_2d(q_goals))
    if reserves is None:
        return PlannedPaths(PlanningEnd.INVALID_END)
    with _seeded(seed, deadline):
        planning = _Planning(checkers, q_start, *reserves, template, deadline)
        paths = planning.run(effort)
    end = (
        PlanningEnd.FOUND
        if paths
        else PlanningEnd.CUT_SHORT
        if deadline.passed
        else PlanningEnd.EXHAUSTED
    )
    v_max = arm.active_limits.v_max
    return PlannedPaths(
        end, sorted(paths, key=lambda path: path_length(path, v_max)), planning.checked_states
    )


def _reserves(
    checkers: ValidityCheckers, q_start: Array, q_goals: Array
) -> tuple[tuple[float, float], Array] | None:
    """First possible reserve and the reserve of narrow regions, and the goals that are valid with
    the first one.

    None if no reserve leaves the start and a goal valid.
    """
    for reserve in PLANNER.reserves:
        checker = checkers[reserve]
        valid = np.array([checker.is_valid(q_goal) for q_goal in q_goals])
        if checker.is_valid(q_start) and valid.any():
            return (reserve, min(reserve, PLANNER.reserves[-2])), q_goals[valid]
    return None


class _Planning:
    """Searches of one planning, in alternation."""

    def __init__(
        self,
        checkers: ValidityCheckers,
        q_start: Array,
        reserves: tuple[float, float],
        q_goals: Array,
        template: Array | None,
        deadline: Deadline,
    ) -> None:
        self._limits, self._weights = (
            checkers.arm.active_limits,
            joint_weights(checkers.arm, checkers.model),
        )
        self._checkers, self._reserves, self._deadline = checkers, reserves, deadline
        self._begin, self._ends = _known_parts(q_start, q_goals, template, self._weights)
        self._searches: dict[SampledBox, PathSearch] = {}
        self._steps = {
            region: PLANNER.step / 2 if region.narrow else PLANNER.step for region in REGIONS
        }
        self.checked_states = 0

    def run(self, effort: Effort) -> list[Array]:
        """Different paths, at most as many as the effort seeks."""
        paths, most_states = list[Array](), effort.most_states
        while True:
            for region in REGIONS:
                if (
                    len(paths) == effort.paths
                    or self._deadline.passed
                    or self.checked_states >= most_states
                ):
                    return paths
                if not region.after <= self.checked_states < region.before:
                    continue
                path = self._slice(region, most_states - self.checked_states)
                if path is None or any(is_same_path(path, other) for other in paths):
                    continue
                paths.append(path)
                if len(path) == 2:
                    # The straight line.
                    return paths
                if len(paths) == 1:
                    effort = USUAL_EFFORT if self.checked_states < effort.easy else effort
                    most_states = min(most_states, self.checked_states + effort.more_states)

    def _slice(self, region: SampledBox, left: int) -> Array | None:
        """Path found by a region's search in its slice, if any; the region then begins a new
        search.

        `left` states may be checked, not counting states checked to shorten a path.
        """
        search = self._searches.get(region)
        if search is None:
            search = self._searches[region] = self._search(region)
        before = search.checked_states
        path = search.path() if search.advance(min(region.states, left)) else None
        if search.is_solved and path is None:
            self._steps[region] /= 2
        # A search that cannot even begin must not be repeated forever.
        self.checked_states += max(search.checked_states - before, 1)
        if search.is_solved:
            del self._searches[region]
        return path

    def _search(self, region: SampledBox) -> PathSearch:
        """New search in a region."""
        ends = np.vstack([self._begin[:1], *(end[-1:] for end in self._ends)])
        return PathSearch(
            self._checkers[self._reserves[region.narrow]],
            self._checkers[PLANNER.reserves[-1]],
            self._weights,
            _box(self._limits, ends, region.margin, self._steps[region]),
            self._begin,
            self._ends,
            self._deadline,
        )


def _known_parts(
    q_start: Array, q_goals: Array, template: Array | None, weights: Array
) -> tuple[Array, list[Array]]:
    """Known parts of a path, (k, nq) each: from the start on, and to every goal (m, nq). They are
    parts of the template, or only the ends.

    Their points are at most `PATH_SEARCH.range` apart.
    """
    if template is None:
        return q_start[None], [q_goal[None] for q_goal in q_goals]
    steps = [
        int(np.linalg.norm((b - a) * weights) / PATH_SEARCH.range) + 1
        for a, b in pairwise(template)
    ]
    pieces = [
        np.linspace(a, b, n, endpoint=False)
        for (a, b), n in zip(pairwise(template), steps, strict=True)
    ]
    begin = np.vstack([*pieces, template[-1:]])
    # Without rounding at the goal.
    return begin, [
        np.vstack([(begin + (q_goal - template[-1]))[:-1], q_goal]) for q_goal in q_goals
    ]


def _box(limits: Limits, ends: Array, margin: float, step: float) -> Box:
    """Range of the ends (k, nq) extended by a margin [rad], within the joint limits."""
    lower, upper = ends.min(axis=0) - margin, ends.max(axis=0) + margin
    return Box(np.maximum(lower, limits.q_min), np.minimum(upper, limits.q_max), step)


@contextmanager
def _seeded(seed: int, deadline: Deadline) -> Iterator[None]:
    """OMPL for the calling thread alone, with seeded random numbers; without OMPL once the deadline
    has passed.
    """
    while not (mine := _OMPL.acquire(timeout=PLANNER.lock_poll)) and not deadline.passed:
        pass
    try:
        if mine:
            # OMPL logs to the console, and warns if a seed is set again, as every call does here.
            ou.setLogLevel(ou.LOG_NONE)
            ou.RNG.setSeed(seed)
        yield
    finally:
        if mine:
            _OMPL.release()
