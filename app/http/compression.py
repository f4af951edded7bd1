"""Compresses answers by `Accept-Encoding`.

Starlette's own middleware ignores weights and compresses in the event loop, which an answer of megabytes would hold up.
"""

from __future__ import annotations

import asyncio
import gzip
from collections.abc import Mapping
from functools import lru_cache

import zstandard
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from joulepath.app.exceptions import NotAcceptable
from joulepath.app.http.accept_encoding import Coding, preferred
from joulepath.app.http.handlers import problem_response

_LEAST = 1024
"""Smaller bodies [byte] fit into one packet anyway."""
_INSTANT = 1 << 15
"""Bodies below this size [byte] are compressed in less time than it takes to pass them to a thread."""
_LEVELS = {"zstd": 3, "gzip": 5}
_FILE_LEVELS = {"zstd": 12, "gzip": 9}
"""Of files, which have an entity tag: they are compressed once and sent often."""
_MOST_FILES = 64
_COMPRESSIBLE = ("text/", "application/json", "application/problem+json", "application/javascript", "model/")
_STREAM = "text/event-stream"


class Compression:
    """ASGI middleware: compresses answers that are sent as a whole. Streams pass unchanged, event by event.

    A header that allows no coding that the service has is the problem `not-acceptable`, before anything is computed.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on, and its answer back compressed."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).getlist("accept-encoding")
        coding = preferred(",".join(given))
        if coding is None:
            response = await problem_response(Request(scope), NotAcceptable())
            await response(scope, receive, send)
            return
        start: Message | None = None

        async def compressed(message: Message) -> None:
            nonlocal start
            if message["type"] == "http.response.start":
                start = message
                return
            if start is not None:
                begun, start = start, None
                message = await _encoded(begun, message, coding)
                await send(begun)
            await send(message)

        await self._app(scope, receive, compressed)


async def _encoded(start: Message, message: Message, coding: Coding) -> Message:
    """The first message of a body, and in `start` the headers that fit it."""
    headers = MutableHeaders(scope=start)
    kind = headers.get("content-type", "")
    if not kind.startswith(_COMPRESSIBLE) or kind.startswith(_STREAM) or "content-encoding" in headers:
        return message
    headers.add_vary_header("Accept-Encoding")
    body: bytes = message.get("body", b"")
    if coding == "identity" or message.get("more_body", False) or len(body) < _LEAST:
        return message
    compress = _compressed_file if "etag" in headers else _compress
    body = compress(body, coding) if len(body) < _INSTANT else await asyncio.to_thread(compress, body, coding)
    headers["Content-Encoding"] = coding
    headers["Content-Length"] = str(len(body))
    if headers.get("etag", "").startswith('"'):
        # the same answer, but not the same bytes
        headers["ETag"] = f"W/{headers['etag']}"
    return {**message, "body": body}


@lru_cache(_MOST_FILES)
def _compressed_file(body: bytes, coding: Coding) -> bytes:
    return _compress(body, coding, _FILE_LEVELS)


def _compress(body: bytes, coding: Coding, levels: Mapping[str, int] = _LEVELS) -> bytes:
    if coding == "zstd":
        # a compressor may not be shared by threads
        return zstandard.ZstdCompressor(level=levels[coding]).compress(body)
    return gzip.compress(body, levels[coding], mtime=0)
