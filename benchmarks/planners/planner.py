"""Protocol of a planner: it plans a motion between two configurations of a robot."""

from __future__ import annotations

from importlib.metadata import version
from typing import Protocol

from benchmarks.motion import Motion
from joulepath.models.robot import Array

# planners that minimise energy get the discretisation of joulepath's own first solve
CONTROL_POINTS = 13
NODES = 31


class Planner(Protocol):
    """Plans motions from standstill to standstill under all limits of a robot. Only `plan` is
    timed.

    `title` is the planner's name, `packages` are the packages that it uses, `what` describes its
    method and limits.
    """

    title: str
    packages: tuple[str, ...]
    what: str

    def plan(self, q_start: Array, q_goal: Array) -> Motion | None:
        """A motion between two configurations (nq,) [rad], or None."""


def versions(planner: Planner) -> str:
    """The planner's packages with their versions."""
    return ", ".join(f"{name} {version(name)}" for name in planner.packages) or "this repository"
