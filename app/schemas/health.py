"""What `GET /healthz` and `GET /readyz` answer."""

from __future__ import annotations

from typing import Literal

from joulepath.app.schemas.common import Response, described


class Alive(Response):
    """The process is alive."""

    status: Literal["alive"] = described("Always `alive`.", None, "alive")


class Ready(Response):
    """All workers are warm: started, with the kernel loaded. The database can be read and written."""

    status: Literal["ready"] = described("Always `ready`.", None, "ready")
    workers: int = described("Number of warm workers.", "1", 2)
