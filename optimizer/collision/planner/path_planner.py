"""Collision-free joint paths between configurations: initial guesses for the optimiser.

Several searches by RRT-Connect (see `path_search`) take turns in short slices, each in a box of its
own: which of them finds a path, and how fast, differs from task to task.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise

import numpy as np
from ompl import util as ou

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.collision.planner.path_search import RANGE, Box, PathSearch, joint_weights
from joulepath.optimizer.collision.planner.state_validity import ValidityCheckers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.problem.arm import Arm

# clearance [m] of a path beyond the margins: the first that the start and a goal have, too
RESERVES = (5e-3, 5e-4, 0.0)
# distance [rad] between the checked states of an edge, in weighted joints. A region where it was
# too long to see that a path collides has half of it from then on
STEP = 0.1
# checked states of a planning, of all its searches
MOST_STATES = 200_000
# checked states of a planning that may follow a known path
STATES_BESIDE = 5_000
# two paths are the same if no joint differs by this much [rad] at the same fraction of their
# lengths
SAME_PATH = 0.5
# linear interpolation between two paths: samples of each path, steps from one to the other, and
# penetration [m] that is allowed, since motions that pass an obstacle on the same side touch it,
# and interpolation may cut its corners
INTERPOLATED, INTERPOLATION_STEPS, ALLOWED_PENETRATION = 33, 9, 0.02
# samples of a path; fraction of its length, on either side, over which its corners are averaged,
# and points of the mean
SAMPLES, ROUNDING, ROUNDING_POINTS = 201, 0.06, 9
# time [s] after which a thread that waits for another one's planner looks at its deadline
PATIENCE = 0.02

# Held from the seed to the last shortcut: every planner, sampler and simplifier of OMPL that is
# made draws its seed from one generator of the process, so that two threads at once would take
# seeds from each other. Little is lost: planners spend their time in the validity checks, which
# need Python's global lock.
_OMPL = threading.Lock()


@dataclass(frozen=True)
class Effort:
    """Of a planning: states that all searches check at most, paths that are sought, and states that
    may be checked for further ones, once one is found. If that takes fewer than `easy` states, both
    are those of USUAL."""

    most_states: int = MOST_STATES
    paths: int = 2
    more_states: int = 3_000
    easy: int = 0


USUAL = Effort()


@dataclass(frozen=True)
class Region:
    """Where a search samples: `margin` [rad] beyond the range between start and goals, within the
    joint limits.

    It takes its turns, of `states` each, between `after` and `before` states of all searches.
    `narrow`: with half of the STEP and a reserve for narrow gaps.
    """

    margin: float
    states: int
    after: float = 0
    before: float = np.inf
    narrow: bool = False


# Narrow bounds give short paths, if any, wide ones find a way out of a cage; no margin lets a path
# turn a joint by a needless full turn. The last searches are for gaps that the reserve or the step
# closes
REGIONS = (
    Region(0.7, 400, before=4_000),
    Region(2.2, 1_600),
    Region(2.2, 800, 20_000, narrow=True),
    Region(3.5, 800, 20_000),
)


class PlanningEnd(Enum):
    """Why a planning ended: with a path, after its states, at the deadline, or because no end is
    valid.
    """

    FOUND = "found"
    EXHAUSTED = "exhausted"
    CUT_SHORT = "cut short"
    INVALID_END = "invalid end"


@dataclass(frozen=True)
class PlannedPaths:
    """Collision-free joint paths, each (k, nq) [rad], the shortest first; why the planning ended,
    and its effort.
    """

    end: PlanningEnd
    paths: list[Array] = field(default_factory=list)
    checked_states: int = 0

    def leading_to(self, q_goal: Array) -> list[Array]:
        """The paths that end at q_goal (nq,) [rad]."""
        return [path for path in self.paths if (path[-1] == q_goal).all()]

    @property
    def message(self) -> str:
        """What is to be said of a planning without a path."""
        match self.end:
            case PlanningEnd.FOUND:
                return "the path planner found a path"
            case PlanningEnd.EXHAUSTED:
                return (
                    f"the path planner found no path in {self.checked_states} checked "
                    "configurations"
                )
            case PlanningEnd.CUT_SHORT:
                return (
                    f"the deadline ended the path planner after {self.checked_states} checked "
                    "configurations"
                )
            case PlanningEnd.INVALID_END:
                return "the path planner has no valid start and goal"


def plan_paths(
    arm: Arm,
    q_start: Array,
    q_goals: Array,
    deadline: Deadline,
    effort: Effort = USUAL,
    seed: int = 1,
    checkers: ValidityCheckers | None = None,
    like: Array | None = None,
) -> PlannedPaths:
    """Collision-free joint paths from q_start (nq,) to any of q_goals, (nq,) or (m, nq) [rad].

    A path is piecewise linear, within the joint limits and the tool cone of the arm. It is checked
    at short steps, which is no proof. The planning ends after about as many checked states as the
    `effort` has, or at `deadline`. Unless the deadline passes, `seed` determines the result.
    `checkers` are those of the arm, if at hand. `like` (k, nq) [rad] is such a path to a goal that
    differs by full turns. Then one path is sought, which may follow it away from the start and,
    turned as fully, to the goal: narrow ways out of an obstacle are found once.
    """
    checkers = ValidityCheckers(arm, collision_model(arm)) if checkers is None else checkers
    if like is not None:
        effort = Effort(min(effort.most_states, STATES_BESIDE), paths=1)
    found = _reserves(checkers, q_start, np.atleast_2d(q_goals))
    if found is None:
        return PlannedPaths(PlanningEnd.INVALID_END)
    with _seeded(seed, deadline):
        planning = _Planning(checkers, q_start, *found, like, deadline)
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
        end, sorted(paths, key=lambda path: length(path, v_max)), planning.checked_states
    )


def _reserves(
    checkers: ValidityCheckers, q_start: Array, q_goals: Array
) -> tuple[tuple[float, float], Array] | None:
    """The first possible reserve, and one for narrow regions; and the goals valid for the first
    one.

    None if no reserve leaves the start and a goal.
    """
    for reserve in RESERVES:
        checker = checkers[reserve]
        valid = np.array([checker.is_valid(q_goal) for q_goal in q_goals])
        if checker.is_valid(q_start) and valid.any():
            return (reserve, min(reserve, RESERVES[-2])), q_goals[valid]
    return None


class _Planning:
    """The searches of one planning, which take turns."""

    def __init__(
        self,
        checkers: ValidityCheckers,
        q_start: Array,
        reserves: tuple[float, float],
        q_goals: Array,
        like: Array | None,
        deadline: Deadline,
    ) -> None:
        self._limits, self._weights = (
            checkers.arm.active_limits,
            joint_weights(checkers.arm, checkers.model),
        )
        self._checkers, self._reserves, self._deadline = checkers, reserves, deadline
        self._begin, self._ends = _leads(q_start, q_goals, like, self._weights)
        self._searches: dict[Region, PathSearch] = {}
        self._steps = {region: STEP / 2 if region.narrow else STEP for region in REGIONS}
        self.checked_states = 0

    def run(self, effort: Effort) -> list[Array]:
        """Different paths, as many as the effort seeks at most."""
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
                if path is None or any(_is_same(path, other) for other in paths):
                    continue
                paths.append(path)
                if len(path) == 2:
                    # the straight line
                    return paths
                if len(paths) == 1:
                    effort = USUAL if self.checked_states < effort.easy else effort
                    most_states = min(most_states, self.checked_states + effort.more_states)

    def _slice(self, region: Region, left: int) -> Array | None:
        """The path that a region's search finds in its turn, if any; then the region begins a new
        search.

        `left` states may be checked, but for those that shorten a path.
        """
        search = self._searches.get(region)
        if search is None:
            search = self._searches[region] = self._search(region)
        before = search.checked_states
        path = search.path() if search.advance(min(region.states, left)) else None
        if search.is_solved and path is None:
            self._steps[region] /= 2
        # a search that cannot even begin must not go on for ever
        self.checked_states += max(search.checked_states - before, 1)
        if search.is_solved:
            del self._searches[region]
        return path

    def _search(self, region: Region) -> PathSearch:
        """A new search in a region."""
        ends = np.vstack([self._begin[:1], *(end[-1:] for end in self._ends)])
        return PathSearch(
            self._checkers[self._reserves[region.narrow]],
            self._checkers[RESERVES[-1]],
            self._weights,
            _box(self._limits, ends, region.margin, self._steps[region]),
            self._begin,
            self._ends,
            self._deadline,
        )


def _leads(
    q_start: Array, q_goals: Array, like: Array | None, weights: Array
) -> tuple[Array, list[Array]]:
    """The known ways, (k, nq) each, from the start on and to each of the goals (m, nq): `like`, or
    the ends alone.

    Their points are at most RANGE apart.
    """
    if like is None:
        return q_start[None], [q_goal[None] for q_goal in q_goals]
    steps = [int(np.linalg.norm((b - a) * weights) / RANGE) + 1 for a, b in pairwise(like)]
    pieces = [
        np.linspace(a, b, n, endpoint=False)
        for (a, b), n in zip(pairwise(like), steps, strict=True)
    ]
    begin = np.vstack([*pieces, like[-1:]])
    # without rounding at the goal
    return begin, [np.vstack([(begin + (q_goal - like[-1]))[:-1], q_goal]) for q_goal in q_goals]


def _box(limits: Limits, ends: Array, margin: float, step: float) -> Box:
    """The range of the ends (k, nq) extended by a margin [rad], within the joint limits."""
    lower, upper = ends.min(axis=0) - margin, ends.max(axis=0) + margin
    return Box(np.maximum(lower, limits.q_min), np.minimum(upper, limits.q_max), step)


@contextmanager
def _seeded(seed: int, deadline: Deadline) -> Iterator[None]:
    """OMPL for the calling thread alone, its random numbers seeded; without OMPL once the deadline
    has passed.
    """
    while not (mine := _OMPL.acquire(timeout=PATIENCE)) and not deadline.passed:
        pass
    try:
        if mine:
            # OMPL logs to the console, and warns of a seed that is set again, as every call does
            # here
            ou.setLogLevel(ou.LOG_NONE)
            ou.RNG.setSeed(seed)
        yield
    finally:
        if mine:
            _OMPL.release()


def along(path: Array, duration: float, v_max: Array) -> tuple[Array, Array]:
    """Samples q (k, nq) [rad] of a path at times t (k,) [s]: at rest at both ends, with rounded
    corners.

    The fraction of the path's length, with each joint divided by v_max (nq,) [rad/s], is 10 τ³ - 15
    τ⁴ + 6 τ⁵ at τ = t / duration.
    """
    reached = lengths(path, v_max)
    tau = np.linspace(0.0, 1.0, SAMPLES)
    fraction = quintic.fraction(tau)
    # the mean over a window, which narrows to nothing at the ends: they must not move
    half_window = np.minimum(ROUNDING, np.minimum(fraction, 1 - fraction))
    averaged = fraction[:, None] + half_window[:, None] * np.linspace(-1.0, 1.0, ROUNDING_POINTS)
    q = np.stack(
        [np.interp(averaged, reached / reached[-1], joint).mean(axis=1) for joint in path.T], axis=1
    )
    return q, tau * duration


def length(path: Array, v_max: Array) -> float:
    """Weighted length [s] of a joint path: the sum over its steps of the norm of Δq / v_max.

    It is the least duration under the limit ‖v / v_max‖ ≤ 1.
    """
    return float(lengths(path, v_max)[-1])


def interpolation_is_free(model: CollisionModel, path: Array, other: Array) -> bool:
    """Whether linear interpolation between two joint paths is collision-free up to
    ALLOWED_PENETRATION.

    The paths (k, nq) [rad] are sampled at the same times. If it is free, an optimiser that starts
    from either path usually finds the same motion.
    """
    chosen = np.linspace(0, len(path) - 1, INTERPOLATED).round().astype(int)
    steps = np.linspace(0.0, 1.0, INTERPOLATION_STEPS + 2)[1:-1, None, None]
    q = (1 - steps) * path[chosen] + steps * other[chosen]
    return model.least_distance(q.reshape(-1, path.shape[1]), 0.0) >= -ALLOWED_PENETRATION


def lengths(path: Array, v_max: Array) -> Array:
    """Weighted length (k,) [s] from the start of a path to each of its points, as in `length`."""
    steps = np.linalg.norm(np.diff(path, axis=0) / v_max, axis=1)
    return np.append(0.0, np.cumsum(steps))


def _is_same(path: Array, other: Array) -> bool:
    """Whether two paths stay within SAME_PATH of each other at the same fractions of their
    lengths."""
    ones = np.ones(path.shape[1])
    return bool(np.abs(along(path, 1.0, ones)[0] - along(other, 1.0, ones)[0]).max() < SAME_PATH)
