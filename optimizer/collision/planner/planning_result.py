"""Result of a path planning."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from joulepath.models.robot import Array


class PlanningEnd(Enum):
    """Cause of the end of a planning: a path, its number of states, the deadline, or no valid
    end.
    """

    FOUND = "found"
    EXHAUSTED = "exhausted"
    CUT_SHORT = "cut short"
    INVALID_END = "invalid end"


@dataclass(frozen=True)
class PlannedPaths:
    """Collision-free joint paths, each (k, nq) [rad], the shortest first, with the cause of the
    planning's end and its effort.
    """

    end: PlanningEnd
    paths: list[Array] = field(default_factory=list)
    checked_states: int = 0

    def ending_at(self, q_goal: Array) -> list[Array]:
        """Paths that end at q_goal (nq,) [rad]."""
        return [path for path in self.paths if (path[-1] == q_goal).all()]

    @property
    def message(self) -> str:
        """Text on the result of the planning."""
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
