"""What `GET /answers/{id}` answers."""

from __future__ import annotations

from datetime import datetime
from typing import Any, ClassVar

from app.schemas.common import Response, described


class KeptAnswer(Response):
    """An answer kept by reference."""

    EXAMPLE_ID: ClassVar[str] = "7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11"

    id: str = described("The answer's id.", None, EXAMPLE_ID)
    kind: str = described("The endpoint that gave it.", None, "optimize")
    created: datetime = described("When it was given, in UTC.", None, "2025-03-14T09:26:53.589793Z")
    answer: dict[str, Any] = described(
        "The answer, as that endpoint documents it.", None, {"robot": "ur5e", "duration": 1.8, "status": "optimal"}
    )
