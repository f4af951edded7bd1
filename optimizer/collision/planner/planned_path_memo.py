"""Memo of the collision-free paths planned for one arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.planner.planning_result import PlannedPaths, PlanningEnd


class PlannedPathMemo:
    """Results of path planning, by the start and goal configurations (nq,) [rad].

    Paths are stored for the goal they reach. The first paths to a goal also serve as a template for
    goals that differ by full turns. A planning without a path is stored for all of these goals,
    unless the deadline ended it. The methods of this class are the only way to change the memo.
    """

    def __init__(self) -> None:
        self._by_goal: dict[bytes, PlannedPaths] = {}
        # First planning with a path, otherwise the last planning, of all goals equal up to turns.
        self._up_to_turns: dict[bytes, PlannedPaths] = {}

    def recall(self, q_start: Array, q_goal: Array, most_states: int) -> PlannedPaths | None:
        """Known result of a planning that may check `most_states` states; None if there is none.

        A result without a path holds only for plannings with no more states.
        """
        turned = self._up_to_turns.get(_key_up_to_turns(q_start, q_goal))
        failed = turned if turned is not None and not turned.paths else None
        for known in (self._by_goal.get(_key(q_start, q_goal)), failed):
            if known is not None and (known.paths or known.checked_states >= most_states):
                return known
        return None

    def template(self, q_start: Array, q_goal: Array) -> Array | None:
        """Shortest known path (k, nq) [rad] to a goal that differs from q_goal by full turns.

        None if there is no such path, or if q_goal itself has been planned for.
        """
        turned = self._up_to_turns.get(_key_up_to_turns(q_start, q_goal))
        if turned is None or not turned.paths or _key(q_start, q_goal) in self._by_goal:
            return None
        return turned.paths[0]

    def keep(self, q_start: Array, goals: Array, planned: PlannedPaths) -> None:
        """Store the result of a planning from q_start (nq,) to `goals` (n, nq) [rad]."""
        for goal in {path[-1].tobytes(): path[-1] for path in planned.paths}.values():
            self._keep(q_start, goal, replace(planned, paths=planned.ending_at(goal)))
        if planned.end is PlanningEnd.EXHAUSTED:
            for goal in goals:
                self._keep(q_start, goal, planned)

    def _keep(self, q_start: Array, q_goal: Array, planned: PlannedPaths) -> None:
        self._by_goal[_key(q_start, q_goal)] = planned
        key = _key_up_to_turns(q_start, q_goal)
        if key not in self._up_to_turns or not self._up_to_turns[key].paths:
            self._up_to_turns[key] = planned

    def has_paths(self, q_start: Array, q_goal: Array) -> bool:
        """Whether a path from q_start to q_goal (nq,) [rad] is known."""
        known = self._by_goal.get(_key(q_start, q_goal))
        return known is not None and bool(known.paths)

    def has_failed(self, q_start: Array, q_goal: Array) -> bool:
        """Whether plannings to q_goal (nq,) [rad], up to full turns, found no path."""
        known = self._up_to_turns.get(_key_up_to_turns(q_start, q_goal))
        return known is not None and not known.paths


def _key(q_start: Array, q_goal: Array) -> bytes:
    return q_start.tobytes() + q_goal.tobytes()


def _key_up_to_turns(q_start: Array, q_goal: Array) -> bytes:
    """Key shared by all goals that differ by full turns."""
    return q_start.tobytes() + (np.round([np.cos(q_goal), np.sin(q_goal)], 6) + 0.0).tobytes()
