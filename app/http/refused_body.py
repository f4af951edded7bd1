"""How a body is refused while it is read."""

from __future__ import annotations

from starlette.exceptions import HTTPException

from joulepath.app.exceptions import ServiceError


class RefusedBody(HTTPException):
    """Carries the service's error through FastAPI, which makes every other exception a 400 without a reason."""

    def __init__(self, error: ServiceError) -> None:
        super().__init__(400)
        self.error = error
