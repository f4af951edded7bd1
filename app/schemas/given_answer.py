"""An answer given in a later request, by its id or as a whole."""

from __future__ import annotations

from typing import Any

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import Request, described
from joulepath.app.schemas.examples.values import ANSWER_ID


class AnswerRequest(Request):
    """A motion of an earlier answer."""

    answer: str | dict[str, Any] = described(
        "A motion: the id (or the path) of a stored answer, or a whole answer, of `POST "
        "/optimize`, `POST /cycle` or `POST /evaluate` with `sample_period`; a point of a front "
        "and a study's iteration by their `answer`.",
        None,
        ANSWER_ID,
    )
    arm: ArmRequest | None = described(
        "The arm of the answer: payload, limits, scene, ... as in the request of the answer. Null: "
        "the field `arm` of the answer. Required if the answer has no `arm`. Its `robot`, if "
        "given, must be the robot of the answer. Not allowed for a cycle.",
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
                "answer", "answer must be the id of a stored answer, or a whole answer"
            )
        return data
