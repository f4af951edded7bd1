"""Ways around what stands between two configurations: first guesses for the optimiser, none of them a motion yet.

J. J. Kuffner, S. M. LaValle, "RRT-Connect: an efficient approach to single-query path planning", IEEE ICRA 2000, as
OMPL has it, run several times; each way found is shortened by OMPL's shortcuts.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from models.robot import Array
from optimizer.collision.model import CollisionModel, collision_model
from optimizer.collision.state_validity import FreeSpace
from optimizer.deadline import Deadline
from optimizer.problem.arm import Arm

# how far the joints may leave the range between start and goal [rad], in turn from run to run: what is near comes
# first, and no way winds a joint
BOUND_MARGINS = (0.7, 1.6, 2.8)
# a way is looked at this densely [rad], and keeps this much [m] more than the margins; less where the ends keep less
STEP, RESERVE = 0.03, (5e-3, 5e-4)
# longest branch of the planner's trees [rad], and states it looks at before a run is given up
RANGE, MOST_STATES = 0.8, 20_000
# runs for each way asked for, and shortcuts tried on each way found
RUNS, SHORTCUTS = 3, 40
# two ways that keep this near to each other throughout are the same [rad]
SAME = 0.5
# samples of two ways and steps from the one to the other, by which it is told whether anything stands between them, and
# how deep [m] bodies may be in one another on that: motions around the same thing touch it and cut its corners
INTERPOLATED, INTERPOLATION_STEPS, ALLOWED_PENETRATION = 33, 9, 0.02
# samples of a way, and the share of its length over which a corner is rounded
SAMPLES, ROUNDING = 201, 0.06
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
    """Up to `most` joint paths (k, nq) [rad] from q_start to q_goal (nq,) that hit nothing, the shortest first.

    Straight between their points, within the arm's limits and its tool's cone; looked at every STEP, which proves
    nothing. None where an end itself is not clear or nothing is found before `deadline`. The
    seed decides what is found, as long as the deadline does not. `model` is the arm's own, where it is at hand.
    """
    model = collision_model(arm) if model is None else model
    for reserve in RESERVE:
        space = FreeSpace(arm, model, reserve)
        if space.free(q_start) and space.free(q_goal):
            break
    else:
        return []
    found: list[Array] = []
    with _seeded(seed, deadline):
        for run in range(RUNS * most):
            if len(found) == most or deadline.passed:
                break
            path = _plan(arm, space, q_start, q_goal, BOUND_MARGINS[run % len(BOUND_MARGINS)], deadline)
            if path is not None and not any(_same(path, other) for other in found):
                found.append(path)
            # the straight line is free, or no room is wide enough
            if (found and len(found[0]) == 2) or (not found and run + 1 == len(BOUND_MARGINS)):
                break
    return sorted(found, key=lambda path: length(path, arm.active_limits.v_max))


@contextmanager
def _seeded(seed: int, deadline: Deadline) -> Iterator[None]:
    """OMPL for the calling thread alone, its random numbers seeded; without OMPL once the deadline has passed."""
    while not (mine := _OMPL.acquire(timeout=PATIENCE)) and not deadline.passed:
        pass
    try:
        if mine:
            # what OMPL has to say goes to the console; and it warns of a seed set anew, which is what is meant here
            ou.setLogLevel(ou.LOG_NONE)
            ou.RNG.setSeed(seed)
        yield
    finally:
        if mine:
            _OMPL.release()


def along(path: Array, duration: float, v_max: Array) -> tuple[Array, Array]:
    """Samples q (k, nq) [rad] at times t (k,) [s] of a way, at rest at both ends, its corners rounded a little.

    The way's length, each joint's weighed by 1 / v_max (nq,), passes by the quintic law 10 s³ - 15 s⁴ + 6 s⁵.
    """
    lengths = _lengths(path, v_max)
    s = np.linspace(0.0, 1.0, SAMPLES)
    passed = s**3 * (10 - 15 * s + 6 * s**2)
    # the mean over a window that narrows to nothing at the ends, which it must not move
    window = np.minimum(ROUNDING, np.minimum(passed, 1 - passed))
    spread = passed[:, None] + window[:, None] * np.linspace(-1.0, 1.0, 9)
    share = lengths / lengths[-1]
    q = np.stack([np.interp(spread, share, joint).mean(axis=1) for joint in path.T], axis=1)
    return q, s * duration


def interpolation_is_free(model: CollisionModel, path: Array, other: Array) -> bool:
    """Whether one way can be drawn straight onto another and hardly hits anything, (k, nq) each at the same times.

    Optimised, the two would then as a rule become the same motion.
    """
    chosen = np.linspace(0, len(path) - 1, INTERPOLATED).round().astype(int)
    steps = np.linspace(0.0, 1.0, INTERPOLATION_STEPS + 2)[1:-1, None, None]
    drawn = (1 - steps) * path[chosen] + steps * other[chosen]
    return model.least(drawn.reshape(-1, path.shape[1]), 0.0) >= -ALLOWED_PENETRATION


def _plan(arm: Arm, space: FreeSpace, start: Array, goal: Array, room: float, deadline: Deadline) -> Array | None:
    """One way (k, nq), shortened; None if there is none in that room before the deadline."""
    nq, limits = len(start), arm.active_limits
    states = ob.RealVectorStateSpace(nq)
    bounds = ob.RealVectorBounds(nq)
    lower = np.maximum(np.minimum(start, goal) - room, limits.q_min)
    upper = np.minimum(np.maximum(start, goal) + room, limits.q_max)
    for joint in range(nq):
        bounds.setLow(joint, float(lower[joint]))
        bounds.setHigh(joint, float(upper[joint]))
    states.setBounds(bounds)
    looked, q, joints = 0, np.empty(nq), range(nq)

    def free(state: ob.RealVectorStateType) -> bool:
        nonlocal looked
        looked += 1
        for joint in joints:
            q[joint] = state[joint]
        return space.free(q)

    def spent() -> bool:
        return looked > MOST_STATES or deadline.passed

    info = ob.SpaceInformation(states)
    info.setStateValidityChecker(free)
    info.setStateValidityCheckingResolution(STEP / states.getMaximumExtent())
    info.setup()
    problem = ob.ProblemDefinition(info)
    problem.setStartAndGoalStates(_state(states, start), _state(states, goal), 1e-9)
    planner = og.RRTConnect(info)
    planner.setRange(RANGE)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(ob.PlannerTerminationCondition(spent))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    # by counts, not by the clock, so that the same seed gives the same way
    shorten = og.PathSimplifier(info)
    shorten.reduceVertices(path, SHORTCUTS, SHORTCUTS)
    shorten.partialShortcutPath(path, SHORTCUTS, SHORTCUTS)
    shorten.reduceVertices(path, SHORTCUTS, SHORTCUTS)
    points = np.array([[state[joint] for joint in joints] for state in path.getStates()])
    return np.asarray(points[np.append(True, np.abs(np.diff(points, axis=0)).max(axis=1) > 0)])


def _state(states: ob.RealVectorStateSpace, q: Array) -> ob.RealVectorStateType:
    state = states.allocState()
    for joint, value in enumerate(q.tolist()):
        state[joint] = value
    return state


def length(path: Array, v_max: Array) -> float:
    """Length [s] of a way: the time that it takes at least, were the joints' speeds added by squares."""
    return float(_lengths(path, v_max)[-1])


def _lengths(path: Array, v_max: Array) -> Array:
    """The length (k,) [s] up to each point."""
    steps = np.linalg.norm(np.diff(path, axis=0) / v_max, axis=1)
    return np.append(0.0, np.cumsum(steps))


def _same(path: Array, other: Array) -> bool:
    """Whether two ways keep near to each other at the same shares of their lengths."""
    ones = np.ones(path.shape[1])
    return bool(np.abs(along(path, 1.0, ones)[0] - along(other, 1.0, ones)[0]).max() < SAME)
