"""What lists show of an answer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from joulepath.app.engine.result import AnswerFigures


def figures_of(answer: Mapping[str, Any]) -> AnswerFigures:
    """The figures of the answer of any endpoint. Only a motion or a round has an energy: of its objective, electrical
    for `evaluate`."""
    given = answer.get("total", answer)
    energy = given.get("energy")
    return AnswerFigures(
        robot=answer.get("robot"),
        energy=None if energy is None else energy[answer.get("objective", "electrical")]["total"],
        duration=None if energy is None else answer["duration"],
        status=answer.get("status"),
    )
