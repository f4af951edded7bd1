"""Fields common to all answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class AnswerFigures:
    """Figures of an answer in lists: robot, energy [J], duration [s] and status, or None."""

    robot: str | None = None
    energy: float | None = None
    duration: float | None = None
    status: str | None = None


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The fields of every answer about a robot. They come first in its JSON: see
    `TaskResult.kept`."""

    request: str
    """Id of the request, as in the header `X-Request-ID`."""
    id: str | None = None
    """Id of this answer: `GET /answers/{id}` returns it again, and exports and replays take it.
    Null if it is not kept."""
    robot: str
    """Name of the robot."""

    @property
    def figures(self) -> AnswerFigures:
        """The figures of this answer in lists."""
        return AnswerFigures(self.robot)


@dataclass(frozen=True, kw_only=True)
class MotionAnswer(Answer):
    """Fields of a motion as answer."""

    arm: dict[str, Any] | None
    """Fields of the request on the arm, without its robot: payload, limits, scene, ... Null above
    64 KiB of JSON."""
