"""Answers of tasks: collection for storage, check of certificates, and figures for lists."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from joulepath.app.answers.envelope import Answer, AnswerFigures
from joulepath.app.engine.result import StoredAnswer, json_document
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.optimizer.presentation.declared_fields import shown_fields
from joulepath.optimizer.result.solution import Solution

LARGEST_ANSWERS = 1 << 26
"""Largest total size [byte] of the answers of one result, before compression."""


class AnswerCollector:
    """Collects complete answers for `TaskResult.stored`."""

    def __init__(self) -> None:
        self._answers: list[StoredAnswer] = []

    def add(self, content: Answer, endpoint: str | None = None, asked: bytes | None = None) -> str:
        """Adds an answer, and sets its fields `id` and `answer`.

        Args:
            content: the answer.
            endpoint: endpoint of the answer; None: the endpoint of most answers of the result.
            asked: request of the answer as JSON; None: not stored.

        Returns:
            The path of the answer.

        Raises:
            InvalidRequest: the answers together exceed `LARGEST_ANSWERS`.
        """
        answer_id = str(uuid.uuid4())
        own = {"id": answer_id, "answer": StoredAnswer(answer_id, b"").path}
        kind: type = type(content)
        kept = replace(content, **{name: own[name] for name in own.keys() & shown_fields(kind)})
        answer = StoredAnswer(answer_id, json_document(kept), content.figures, endpoint, asked)
        self._answers.append(answer)
        if sum(len(each.body) for each in self._answers) > LARGEST_ANSWERS:
            message = (
                "The answers are too large together: use a longer `sample_period`, or ask for fewer"
            )
            raise InvalidRequest([{"loc": ["body"], "msg": message}])
        return answer.path

    @property
    def stored(self) -> tuple[StoredAnswer, ...]:
        """The answers so far."""
        return tuple(self._answers)


def certified(solution: Solution) -> Solution:
    """Returns the solution unchanged, after a check of its certificate.

    Raises:
        AssertionError: the certificate is not valid, although the optimizer returns certified
            motions only.
    """
    if not solution.certificate.valid:
        raise AssertionError(
            f"The certificate of the optimizer's motion is not valid: {solution.certificate}"
        )
    return solution


def figures_of(answer: Mapping[str, Any]) -> AnswerFigures:
    """Figures of the JSON answer of any endpoint.

    A motion or a cycle is listed with the energy of its objective, an evaluation with the
    electrical energy, and a placement with the energy of its best place.
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
