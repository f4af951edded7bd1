"""Answers that come back in a request, by id or whole."""

from __future__ import annotations

from typing import Any

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import Request, described
from joulepath.app.schemas.examples.values import ANSWER_ID


class AnswerRequest(Request):
    """A motion that was answered before."""

    answer: str | dict[str, Any] = described(
        "A motion: the id (or the path) of a kept answer, or a whole answer, of `POST /optimize`, "
        "`POST /cycle` or `POST /evaluate` with `sample_period`; a point of a front and a study's "
        "iteration by their `answer`.",
        None,
        ANSWER_ID,
    )
    arm: ArmRequest | None = described(
        "The arm of the answer: payload, limits, scene, ... as in its request. Null: what the "
        "answer says in `arm`. Needed if that is null. Its `robot` is that of the answer. Not for "
        "a cycle.",
        None,
        {"payload": {"mass": 2.0, "com": [0.0, 0.0, 0.05]}},
        default=None,
    )

    @model_validator(mode="before")
    @classmethod
    def _answer_is_one(cls, data: Any) -> Any:
        if (
            isinstance(data, dict)
            and "answer" in data
            and not isinstance(data["answer"], str | dict)
        ):
            raise PydanticCustomError(
                "answer", "answer must be the id of a kept answer, or a whole answer"
            )
        return data
