"""Figures of an answer in lists."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from joulepath.app.answers.envelope import AnswerFigures


def figures_of(answer: Mapping[str, Any]) -> AnswerFigures:
    """The figures of the JSON answer of any endpoint.

    The energy of a motion or cycle is the one of its objective, electrical for `evaluate`; that of
    a placement is the one of the best place.
    """
    best = answer.get("best")
    if isinstance(best, Mapping):
        return AnswerFigures(answer["robot"], best["energy"], best["duration"], answer["status"])
    given = answer.get("total", answer)
    energy, objective = given.get("energy"), answer.get("objective", "electrical")
    return AnswerFigures(
        robot=answer.get("robot"),
        energy=energy and energy[objective]["total"],
        duration=None if energy is None else answer["duration"],
        status=answer.get("status"),
    )
