"""What `GET /healthz` and `GET /readyz` answer."""

from __future__ import annotations

from typing import Literal

from app.schemas.common import Response, described


class Alive(Response):
    """The process answers."""

    status: Literal["alive"] = described("Always `alive`.", None, "alive")


class Ready(Response):
    """The workers are warm."""

    status: Literal["ready"] = described("Always `ready`.", None, "ready")
    workers: int = described("Warm workers.", "1", 2)
