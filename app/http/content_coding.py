"""Unpacks bodies that are sent with `Content-Encoding: gzip` or `deflate`, a piece at a time."""

from __future__ import annotations

import asyncio
import zlib

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.exceptions import InvalidRequest, UnsupportedCoding
from app.http.refused_body import RefusedBody

_PIECE = 1 << 16
"""Bytes that are unpacked at a time: what a body takes at most before its size is checked."""
_WINDOWS = {"gzip": 31, "x-gzip": 31, "deflate": 15}
"""Formats of zlib by coding: with the header of gzip, or with its own."""
_DAMAGED = "The body is not complete or not what its `Content-Encoding` says: send it again, or leave the header out"


class ContentCoding:
    """ASGI middleware: routes read the unpacked body.

    It is inside `BodyLimit`, which counts what arrives; a second one inside counts what is unpacked. Reading raises
    RefusedBody for a coding that is not known, and for a damaged body.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on as if its body had been sent unpacked."""
        headers = MutableHeaders(raw=list(scope["headers"])) if scope["type"] == "http" else MutableHeaders()
        coding = ",".join(headers.getlist("content-encoding")).strip().lower()
        if coding in ("", "identity"):
            await self._app(scope, receive, send)
            return
        if coding in _WINDOWS:
            for name in ("content-encoding", "content-length"):
                if name in headers:
                    del headers[name]
            scope = {**scope, "headers": headers.raw}
            receive = _Unpacked(receive, _WINDOWS[coding])
        else:
            receive = _refuse
        await self._app(scope, receive, send)


async def _refuse() -> Message:
    raise RefusedBody(UnsupportedCoding())


class _Unpacked:
    """Messages of a request whose body is unpacked: one piece each."""

    def __init__(self, receive: Receive, window: int) -> None:
        self._receive = receive
        self._window = window
        self._stream = zlib.decompressobj(window)
        self._packed = b""
        self._more = True
        self._done = False

    async def __call__(self) -> Message:
        """The next message. Raises RefusedBody."""
        while not self._packed and self._more:
            message = await self._receive()
            if message["type"] != "http.request":
                return message
            self._packed, self._more = message.get("body", b""), message.get("more_body", False)
        if self._done:
            return await self._receive()
        await asyncio.sleep(0)  # others have a turn between two pieces of a large body
        piece = self._piece()
        if not self._packed and not self._more and not piece:
            if not self._stream.eof:
                raise RefusedBody(InvalidRequest([{"loc": ["body"], "msg": _DAMAGED}]))
            self._done = True
        return {"type": "http.request", "body": piece, "more_body": not self._done}

    def _piece(self) -> bytes:
        if self._packed and self._stream.eof:  # the next member of the same file
            self._stream = zlib.decompressobj(self._window)
        try:
            piece = self._stream.decompress(self._packed, _PIECE)
        except zlib.error:
            raise RefusedBody(InvalidRequest([{"loc": ["body"], "msg": _DAMAGED}])) from None
        self._packed = self._stream.unused_data if self._stream.eof else self._stream.unconsumed_tail
        return piece
