"""One resumable search for a collision-free joint path by OMPL: RRT-Connect in a box of
configurations.

J. J. Kuffner, S. M. LaValle, "RRT-Connect: an efficient approach to single-query path planning",
IEEE ICRA 2000, in the implementation of OMPL; OMPL's path simplifier shortens the path.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from ompl import base as ob
from ompl import geometric as og

from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.planner.state_validity import StateValidityChecker
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class PathSearchSettings:
    """Settings of RRT-Connect and of the simplification of its paths."""

    range: float = 0.4
    """OMPL's range: largest length [rad] of an edge of the trees, in weighted joints."""
    shortcuts: int = 40
    """Shortcuts tried on a path."""
    last_step: float = 0.02
    """Distance [rad], in weighted joints, between the states of the final check of a path."""
    least_weight: float = 0.1
    """Smallest weight of a joint [1]."""


PATH_SEARCH = PathSearchSettings()


@dataclass(frozen=True)
class Box:
    """Configurations (nq,) [rad] that a search samples, and the distance `step` [rad] between
    checked states of an edge, in weighted joints.
    """

    lower: Array
    upper: Array
    step: float

    def inside(self, q: Array) -> Array:
        """Configurations among (k, nq) [rad] that lie in the box."""
        return q[((q >= self.lower) & (q <= self.upper)).all(axis=1)]


def joint_weights(arm: Arm, model: CollisionModel) -> Array:
    """Weights (nq,) of the joints in the distances between configurations: between `least_weight`
    and 1.

    The weight is the square root of a joint's longest lever over the longest of all joints. With
    the lever itself as the weight, wrists would turn at will; with equal weights, a turn of the
    wrist would be checked as densely as a turn of the base. With a cone for the tool axis, wrists
    count as much as any joint.
    """
    levers = model.coupling.most_on_arm(model.levers().max(axis=0, initial=0.0))
    if arm.tool_cone is not None or not levers.any():
        return np.ones(arm.robot.nq)
    return np.asarray(np.maximum(np.sqrt(levers / levers.max()), PATH_SEARCH.least_weight))


class _ValidityBudget:
    """State validity checks of one search, which pauses when its allowance is used up or at the
    deadline.

    It holds no reference to OMPL's objects, since these hold a reference to it: a cycle through
    them would never be freed.
    """

    def __init__(
        self, checker: StateValidityChecker, weights: Array, step: float, deadline: Deadline
    ) -> None:
        self._checker, self._deadline, self._weights = checker, deadline, weights
        self._step, self._joints = step, range(len(weights))
        self.checked_states, self.allowed = 0, 0

    def is_valid(self, state: ob.RealVectorStateType) -> bool:
        """Whether a state of OMPL is valid."""
        self.checked_states += 1
        return self._checker.is_valid(self._configuration(state))

    def is_valid_between(self, first: ob.RealVectorStateType, last: ob.RealVectorStateType) -> bool:
        """Whether the line between two states of OMPL, of which the first is valid, is valid."""
        q, q_end = self._configuration(first), self._configuration(last)
        count = max(math.ceil(float(np.linalg.norm((q_end - q) * self._weights)) / self._step), 1)
        is_valid, checked = self._checker.is_valid_between(q, q_end, count)
        self.checked_states += checked
        return is_valid

    def _configuration(self, state: ob.RealVectorStateType) -> Array:
        """Joint positions (nq,) [rad] of a state of OMPL, whose joints are weighted."""
        return np.array([state[joint] for joint in self._joints]) / self._weights

    def is_spent(self) -> bool:
        """Whether the search must pause."""
        return self.checked_states >= self.allowed or self._deadline.passed


class _MotionValidator(ob.MotionValidator):  # type: ignore[misc]
    """Checks the line between two states in one call of the C library."""

    def __init__(self, information: ob.SpaceInformation, budget: _ValidityBudget) -> None:
        super().__init__(information)
        self._budget = budget

    def checkMotion(self, first: ob.State, last: ob.State) -> bool:
        """Whether the line between two states is valid."""
        return self._budget.is_valid_between(first, last)


class PathSearch:
    """Search in a box. `advance` resumes it.

    The path begins at the first point of `begin` (k, nq) [rad], a collision-free path, and leaves
    it at any of its points. It ends at the last point of one of the paths `ends`, (m, nq) each, and
    joins this path at any of its points. `last_checker` checks the path at short steps with a
    smaller reserve, which limits the corners cut by long steps.
    """

    def __init__(
        self,
        checker: StateValidityChecker,
        last_checker: StateValidityChecker,
        weights: Array,
        box: Box,
        begin: Array,
        ends: Sequence[Array],
        deadline: Deadline,
    ) -> None:
        self._weights, self._begin, self._ends = weights, begin, ends
        self._budget = _ValidityBudget(checker, weights, box.step, deadline)
        space = ob.RealVectorStateSpace(len(weights))
        bounds = ob.RealVectorBounds(len(weights))
        for joint, (low, high) in enumerate(
            zip(box.lower * weights, box.upper * weights, strict=True)
        ):
            bounds.setLow(joint, float(low))
            bounds.setHigh(joint, float(high))
        space.setBounds(bounds)
        self._information = ob.SpaceInformation(space)
        self._information.setStateValidityChecker(self._budget.is_valid)
        self._information.setMotionValidator(_MotionValidator(self._information, self._budget))
        self._information.setup()
        self._problem = ob.ProblemDefinition(self._information)
        self._space = space
        for q in box.inside(begin):
            self._problem.addStartState(self._state(q))
        goals = ob.GoalStates(self._information)
        for q in box.inside(np.vstack(ends)):
            goals.addState(self._state(q))
        self._problem.setGoal(goals)
        self._last_checker = last_checker
        self._planner = og.RRTConnect(self._information)
        self._planner.setRange(PATH_SEARCH.range)
        self._planner.setProblemDefinition(self._problem)
        self._planner.setup()

    @property
    def checked_states(self) -> int:
        """States checked so far."""
        return self._budget.checked_states

    @property
    def is_solved(self) -> bool:
        """Whether a path is found."""
        return bool(self._problem.hasExactSolution())

    def advance(self, states: int) -> bool:
        """Resumes the search for about `states` more checked states; returns whether a path is
        found.
        """
        self._budget.allowed = self._budget.checked_states + states
        self._planner.solve(ob.PlannerTerminationCondition(self._budget.is_spent))
        return self.is_solved

    def path(self) -> Array | None:
        """Shortened path (k, nq) [rad]; None if a dense check finds a state of it in collision."""
        path = self._whole(self._problem.getSolutionPath())
        # Limited by counts, not by the clock, so that the same seed gives the same path.
        simplifier = og.PathSimplifier(self._information)
        simplifier.reduceVertices(path, PATH_SEARCH.shortcuts, PATH_SEARCH.shortcuts)
        simplifier.partialShortcutPath(path, PATH_SEARCH.shortcuts, PATH_SEARCH.shortcuts)
        simplifier.reduceVertices(path, PATH_SEARCH.shortcuts, PATH_SEARCH.shortcuts)
        joints = range(len(self._weights))
        points = (
            np.array([[state[joint] for joint in joints] for state in path.getStates()])
            / self._weights
        )
        points = points[np.append(True, np.abs(np.diff(points, axis=0)).max(axis=1) > 0)]
        # Without the rounding of the weights.
        chosen, _ = _nearest([end[-1:] for end in self._ends], points[-1])
        points[0], points[-1] = self._begin[0], self._ends[chosen][-1]
        return points if self._is_valid(points) else None

    def _whole(self, path: og.PathGeometric) -> og.PathGeometric:
        """The path found, extended by its known parts before and after."""
        states = path.getStates()
        first, last = (
            np.array([state[j] for j in range(len(self._weights))]) / self._weights
            for state in (states[0], states[-1])
        )
        _, left = _nearest([self._begin], first)
        chosen, met = _nearest(self._ends, last)
        for q in self._begin[:left][::-1]:
            path.prepend(self._state(q))
        for q in self._ends[chosen][met + 1 :]:
            path.append(self._state(q))
        return path

    def _is_valid(self, points: Array) -> bool:
        """Whether states `last_step` apart along a path (k, nq) are valid."""
        for first, second in pairwise(points):
            count = (
                int(np.linalg.norm((second - first) * self._weights) / PATH_SEARCH.last_step) + 1
            )
            if not self._last_checker.is_valid_between(first, second, count)[0]:
                return False
        return True

    def _state(self, q: Array) -> ob.RealVectorStateType:
        state = self._space.allocState()
        for joint, value in enumerate((q * self._weights).tolist()):
            state[joint] = value
        return state


def _nearest(paths: Sequence[Array], q: Array) -> tuple[int, int]:
    """Indices of the path (k, nq), and of its point, nearest to q (nq,)."""
    distances = [np.abs(path - q).max(axis=1) for path in paths]
    chosen = min(range(len(paths)), key=lambda k: float(distances[k].min()))
    return chosen, int(distances[chosen].argmin())
