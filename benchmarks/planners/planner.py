"""Protocol of a planner: it plans a motion between two configurations of a robot."""

from __future__ import annotations

from importlib.metadata import version
from typing import Protocol

from benchmarks.motion import Motion
from joulepath.models.robot import Array

# the discretisation of joulepath's first solve, for all planners of least energy
CONTROL_POINTS = 13
NODES = 31


class Planner(Protocol):
    """A planner of motions from rest to rest within all limits of a robot. Only `plan` is timed.

    `title` is the name of the planner, `packages` are its packages, and `what` describes its method
    and limits.
    """

    title: str
    packages: tuple[str, ...]
    what: str

    def plan(self, q_start: Array, q_goal: Array) -> Motion | None:
        """A motion between two configurations (nq,) [rad], or None."""


def versions(planner: Planner) -> str:
    """The packages of a planner with their versions."""
    return ", ".join(f"{name} {version(name)}" for name in planner.packages) or "this repository"
