"""Rejects bodies above a size, declared or not.

Starlette's own middleware for this answers in plain text, also in place of another response.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send


class BodyLimit:
    """ASGI middleware: reading a body of more than `most` bytes raises HTTPException(413).

    `uploads` has other limits [byte] for some paths; each path is a regular expression.
    """

    def __init__(self, app: ASGIApp, most: int, uploads: Mapping[str, int]) -> None:
        self._app = app
        self._most = most
        self._uploads = uploads

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on and counts the bytes of its body."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        most = next((most for path, most in self._uploads.items() if re.fullmatch(path, scope["path"])), self._most)
        declared = Headers(scope=scope).get("content-length", "")
        size = int(declared) if declared.isdecimal() else 0

        async def limited() -> Message:
            nonlocal size
            if size > most:  # as declared: it need not be read
                raise HTTPException(413)
            message = await receive()
            if not declared:
                size += len(message.get("body", b""))
            if size > most:
                raise HTTPException(413)
            return message

        await self._app(scope, limited, send)
