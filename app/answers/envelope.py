"""The fields that answers have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class AnswerFigures:
    """What lists show of an answer: robot, energy [J], duration [s] and status; None if it has
    none.
    """

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
        """What lists show of this answer."""
        return AnswerFigures(self.robot)


@dataclass(frozen=True, kw_only=True)
class MotionAnswer(Answer):
    """The fields of an answer that is a motion."""

    arm: dict[str, Any] | None
    """What the request says of the arm beside its robot: payload, limits, scene, ... as it was
    sent. Null if that is larger than 64 KiB of JSON."""
