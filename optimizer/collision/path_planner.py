"""Collision-free joint paths between two configurations: initial guesses for the optimiser.

J. J. Kuffner, S. M. LaValle, "RRT-Connect: an efficient approach to single-query path planning", IEEE ICRA 2000, in the
implementation of OMPL, run several times; OMPL's path simplifier shortens each path.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from models.robot import Array, Limits
from optimizer.collision.model import CollisionModel, collision_model
from optimizer.collision.state_validity import StateValidityChecker
from optimizer.deadline import Deadline
from optimizer.problem.arm import Arm
from optimizer.trajectories import quintic

# sampling bounds: how far [rad] they extend beyond the range between start and goal, one value per run in turn. Narrow
# bounds come first, and none lets a path turn a joint by a needless full turn
BOUND_MARGINS = (0.7, 1.6, 2.8)
# largest distance [rad], Euclidean over the joints, between the checked states of an edge
STEP = 0.03
# clearance [m] of a path beyond the margins: the first that start and goal have, too
RESERVES = (5e-3, 5e-4)
# OMPL's range: maximum length [rad] of an edge of the planner's trees
RANGE = 0.8
# a run is given up after this many checked states
MOST_STATES = 20_000
# runs per path asked for, and shortcuts tried on each path
RUNS, SHORTCUTS = 3, 40
# two paths are the same if no joint differs by this much [rad] at the same fraction of their lengths
SAME_PATH = 0.5
# linear interpolation between two paths: samples of each path, steps from one to the other, and penetration [m] that is
# allowed, since motions that pass an obstacle on the same side touch it, and interpolation may cut its corners
INTERPOLATED, INTERPOLATION_STEPS, ALLOWED_PENETRATION = 33, 9, 0.02
# samples of a path; fraction of its length, on either side, over which its corners are averaged, and points of the mean
SAMPLES, ROUNDING, ROUNDING_POINTS = 201, 0.06, 9
# time [s] after which a thread that waits for another one's planner looks at its deadline
PATIENCE = 0.02

# Held from the seed to the last shortcut: every planner, sampler and simplifier of OMPL that is made draws its seed
# from one generator of the process, so that two threads at once would take seeds from each other. Little is lost:
# planners spend their time in the validity checks, which need Python's global lock.
_OMPL = threading.Lock()


def plan_paths(
    arm: Arm,
    q_start: Array,
    q_goal: Array,
    deadline: Deadline,
    most: int = 2,
    seed: int = 1,
    model: CollisionModel | None = None,
) -> list[Array]:
    """Up to `most` collision-free joint paths (k, nq) [rad] from q_start to q_goal (nq,), the shortest first.

    A path is piecewise linear, within the joint limits and the tool cone of the arm. It is checked every STEP, which is
    no proof. The list is empty if start or goal is not valid, or if nothing is found before `deadline`. Unless the
    deadline passes, `seed` determines the result. `model` is the collision model of the arm, if at hand.
    """
    model = collision_model(arm) if model is None else model
    checkers = (StateValidityChecker(arm, model, reserve) for reserve in RESERVES)
    checker = next((each for each in checkers if each.is_valid(q_start) and each.is_valid(q_goal)), None)
    if checker is None:
        return []
    paths: list[Array] = []
    with _seeded(seed, deadline):
        for run in range(RUNS * most):
            if len(paths) == most or deadline.passed:
                break
            bounds = _bounds(arm.active_limits, q_start, q_goal, BOUND_MARGINS[run % len(BOUND_MARGINS)])
            path = _plan(checker, bounds, q_start, q_goal, deadline)
            if path is not None and not any(_is_same(path, other) for other in paths):
                paths.append(path)
            straight_line_is_free = bool(paths) and len(paths[0]) == 2
            all_bounds_failed = not paths and run + 1 == len(BOUND_MARGINS)
            if straight_line_is_free or all_bounds_failed:
                break
    return sorted(paths, key=lambda path: length(path, arm.active_limits.v_max))


@contextmanager
def _seeded(seed: int, deadline: Deadline) -> Iterator[None]:
    """OMPL for the calling thread alone, its random numbers seeded; without OMPL once the deadline has passed."""
    while not (mine := _OMPL.acquire(timeout=PATIENCE)) and not deadline.passed:
        pass
    try:
        if mine:
            # OMPL logs to the console, and warns of a seed that is set again, as every call does here
            ou.setLogLevel(ou.LOG_NONE)
            ou.RNG.setSeed(seed)
        yield
    finally:
        if mine:
            _OMPL.release()


def along(path: Array, duration: float, v_max: Array) -> tuple[Array, Array]:
    """Samples q (k, nq) [rad] of a path at times t (k,) [s]: at rest at both ends, with rounded corners.

    The fraction of the path's length, with each joint divided by v_max (nq,) [rad/s], is 10 τ³ - 15 τ⁴ + 6 τ⁵ at
    τ = t / duration.
    """
    reached = lengths(path, v_max)
    tau = np.linspace(0.0, 1.0, SAMPLES)
    fraction = quintic.fraction(tau)
    # the mean over a window, which narrows to nothing at the ends: they must not move
    half_window = np.minimum(ROUNDING, np.minimum(fraction, 1 - fraction))
    averaged = fraction[:, None] + half_window[:, None] * np.linspace(-1.0, 1.0, ROUNDING_POINTS)
    q = np.stack([np.interp(averaged, reached / reached[-1], joint).mean(axis=1) for joint in path.T], axis=1)
    return q, tau * duration


def length(path: Array, v_max: Array) -> float:
    """Weighted length [s] of a joint path: the sum over its steps of the norm of Δq / v_max.

    It is the least duration under the limit ‖v / v_max‖ ≤ 1.
    """
    return float(lengths(path, v_max)[-1])


def interpolation_is_free(model: CollisionModel, path: Array, other: Array) -> bool:
    """Whether linear interpolation between two joint paths is collision-free up to ALLOWED_PENETRATION.

    The paths (k, nq) [rad] are sampled at the same times. If it is free, an optimiser that starts from either path
    usually finds the same motion.
    """
    chosen = np.linspace(0, len(path) - 1, INTERPOLATED).round().astype(int)
    steps = np.linspace(0.0, 1.0, INTERPOLATION_STEPS + 2)[1:-1, None, None]
    q = (1 - steps) * path[chosen] + steps * other[chosen]
    return model.least_distance(q.reshape(-1, path.shape[1]), 0.0) >= -ALLOWED_PENETRATION


def _bounds(limits: Limits, q_start: Array, q_goal: Array, margin: float) -> ob.RealVectorBounds:
    """Sampling bounds: the range between start and goal extended by `margin` [rad], within the joint limits."""
    lower = np.maximum(np.minimum(q_start, q_goal) - margin, limits.q_min)
    upper = np.minimum(np.maximum(q_start, q_goal) + margin, limits.q_max)
    bounds = ob.RealVectorBounds(len(q_start))
    for joint in range(len(q_start)):
        bounds.setLow(joint, float(lower[joint]))
        bounds.setHigh(joint, float(upper[joint]))
    return bounds


class _Effort:
    """State validity checks of one run of the planner, which ends at MOST_STATES of them or at the deadline.

    It holds no reference to OMPL's objects, which hold one to it: a cycle through them would never be freed.
    """

    def __init__(self, checker: StateValidityChecker, nq: int, deadline: Deadline) -> None:
        self._checker, self._deadline = checker, deadline
        self._joints, self._q = range(nq), np.empty(nq)
        self._checked_states = 0

    def is_valid(self, state: ob.RealVectorStateType) -> bool:
        """Whether a state of OMPL is valid."""
        self._checked_states += 1
        for joint in self._joints:
            self._q[joint] = state[joint]
        return self._checker.is_valid(self._q)

    def is_spent(self) -> bool:
        """Whether the run must end."""
        return self._checked_states > MOST_STATES or self._deadline.passed


def _plan(
    checker: StateValidityChecker, bounds: ob.RealVectorBounds, q_start: Array, q_goal: Array, deadline: Deadline
) -> Array | None:
    """One run: a shortened collision-free path (k, nq) [rad]; None if none is found."""
    effort = _Effort(checker, len(q_start), deadline)
    space = ob.RealVectorStateSpace(len(q_start))
    space.setBounds(bounds)
    information = ob.SpaceInformation(space)
    information.setStateValidityChecker(effort.is_valid)
    information.setStateValidityCheckingResolution(STEP / space.getMaximumExtent())
    information.setup()
    problem = ob.ProblemDefinition(information)
    problem.setStartAndGoalStates(_state(space, q_start), _state(space, q_goal), 1e-9)
    planner = og.RRTConnect(information)
    planner.setRange(RANGE)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(ob.PlannerTerminationCondition(effort.is_spent))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    # limited by counts, not by the clock, so that the same seed gives the same path
    simplifier = og.PathSimplifier(information)
    simplifier.reduceVertices(path, SHORTCUTS, SHORTCUTS)
    simplifier.partialShortcutPath(path, SHORTCUTS, SHORTCUTS)
    simplifier.reduceVertices(path, SHORTCUTS, SHORTCUTS)
    points = np.array([[state[joint] for joint in range(len(q_start))] for state in path.getStates()])
    is_distinct = np.append(True, np.abs(np.diff(points, axis=0)).max(axis=1) > 0)
    return np.asarray(points[is_distinct])


def _state(space: ob.RealVectorStateSpace, q: Array) -> ob.RealVectorStateType:
    state = space.allocState()
    for joint, value in enumerate(q.tolist()):
        state[joint] = value
    return state


def lengths(path: Array, v_max: Array) -> Array:
    """Weighted length (k,) [s] from the start of a path to each of its points, as in `length`."""
    steps = np.linalg.norm(np.diff(path, axis=0) / v_max, axis=1)
    return np.append(0.0, np.cumsum(steps))


def _is_same(path: Array, other: Array) -> bool:
    """Whether two paths stay within SAME_PATH of each other at the same fractions of their lengths."""
    ones = np.ones(path.shape[1])
    return bool(np.abs(along(path, 1.0, ones)[0] - along(other, 1.0, ones)[0]).max() < SAME_PATH)
