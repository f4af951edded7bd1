"""What `GET /answers/{id}` answers."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from app.schemas.common import Response, described
from app.schemas.examples.values import ANSWER_ID, CREATED


class StoredAnswer(Response):
    """A complete answer to which another answer refers."""

    id: str = described("Id of the answer.", None, ANSWER_ID)
    kind: str = described("Endpoint of the answer: `optimize` or `evaluate`.", None, "optimize")
    created: datetime = described("Time at which it was computed, in UTC.", None, CREATED)
    owner: str | None = described("Name of the API key that asked for it; null without one.", None, "press_shop")
    answer: dict[str, Any] = described(
        "The answer, with the fields that this endpoint documents.",
        None,
        {"robot": "ur5e", "duration": 1.8, "status": "optimal"},
    )
