"""Bodies of requests: unpacked by `Content-Encoding`, within a size and a time, and counted as
bytes in flight.
"""

from __future__ import annotations

import asyncio
import re
import zlib
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import zstandard
from starlette.requests import Request
from starlette.types import Message, Receive

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.queue import ShuttingDown
from joulepath.app.exceptions.transport import BodyTooLarge, RequestTimeout, UnsupportedCoding
from joulepath.app.http.bytes_in_flight import Held
from joulepath.app.settings import Settings

_DAMAGED = (
    "The body is not complete or not what its `Content-Encoding` says: send it again, or leave the "
    "header out"
)


@dataclass(frozen=True)
class Bodies:
    """Bodies in transfer, and their limits.

    `slice` bytes are unpacked at a time, and `piece` bytes passed on. A zstd block of 4 bytes
    unpacks to 128 KiB, so that one slice may become some 4 MiB.
    """

    settings: Settings
    small: int = 1 << 16
    """Largest body read at once [byte]; larger bodies share one part per turn of the event loop."""
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)
    slice: int = 128
    piece: int = 1 << 16
    window: int = 1 << 23
    """Largest window of a zstd frame [byte], as RFC 8878 requires of decoders."""
    reading: set[asyncio.Timeout] = field(default_factory=set)
    """Time-outs of bodies waiting for their next part."""

    def drain(self) -> None:
        """Refuses incomplete bodies."""
        for limit in [
            each for each in self.reading if not each.expired()
        ]:  # one that has just run out ends by itself
            limit.reschedule(0)

    def most(self, path: str) -> int:
        """Largest body of a path [byte]."""
        settings = self.settings
        uploads = {
            "/evaluate|/logs|/robots|/robots/[^/]+": settings.max_upload_bytes,
            "/jobs": settings.max_job_bytes,
            "/studies/[^/]+/iterations|/whatif": settings.max_iteration_bytes,
        }
        return next(
            (most for paths, most in uploads.items() if re.fullmatch(paths, path)),
            settings.max_body_bytes,
        )

    def stream(self, coding: str) -> Any:
        """A decompressor of one member of a body, like `zlib.decompressobj`.

        Raises UnsupportedCoding.
        """
        if coding in ("gzip", "x-gzip", "deflate"):
            return zlib.decompressobj(zlib.MAX_WBITS | 32)
        if coding == "zstd":
            return zstandard.ZstdDecompressor(max_window_size=self.window).decompressobj()
        raise UnsupportedCoding


class RequestBody:
    """The body of one request.

    Reading it raises BodyTooLarge, RequestTimeout, TooManyBytes or TooManyBytesOfClient beyond a
    limit, UnsupportedCoding, InvalidRequest if it is damaged, and ShuttingDown.
    """

    def __init__(self, bodies: Bodies, request: Request, receive: Receive, held: Held) -> None:
        self._bodies, self._receive, self._held = bodies, receive, held
        self._most = bodies.most(request.url.path)
        declared = request.headers.get("content-length", "")
        self._declared = int(declared) if declared.isdecimal() else 0
        coding = ",".join(request.headers.getlist("content-encoding")).strip().lower()
        parts = self._arriving()
        self._parts = (
            parts
            if coding in ("", "identity")
            else self._unpacked(parts, partial(bodies.stream, coding))
        )
        self._is_whole = False

    async def receive(self) -> Message:
        """The next message: a part of the body, its end, or a later message."""
        part = None if self._is_whole else await anext(self._parts, None)
        if part is not None:
            return {"type": "http.request", "body": part, "more_body": True}
        if not self._is_whole:
            self._is_whole = True
            return {"type": "http.request", "body": b"", "more_body": False}
        return await self._receive()

    def _admit(self, size: int) -> None:
        if size > self._most:
            raise BodyTooLarge
        self._held.hold(size)

    async def _arriving(self) -> AsyncIterator[bytes]:
        """The parts of the body as they are sent. A declared size counts before the first one is
        read.
        """
        size, time = self._declared, self._bodies.settings.body_timeout
        self._admit(size)
        until, received, more = asyncio.get_running_loop().time() + time, 0, True
        while more:
            if max(received, size) > self._bodies.small:
                async with self._bodies.turn:
                    await asyncio.sleep(0)
            try:
                async with asyncio.timeout_at(until) as limit:
                    self._bodies.reading.add(limit)
                    try:
                        message = await self._receive()
                    finally:
                        self._bodies.reading.discard(limit)
            except TimeoutError:
                raise (RequestTimeout(time) if limit.when() == until else ShuttingDown()) from None
            if message["type"] == "http.disconnect":
                self._is_whole = True  # the server repeats the message, which comes after the body
                return
            received += len(message.get("body", b""))
            self._admit(max(received, self._declared))
            yield message.get("body", b"")
            more = message.get("more_body", False)

    async def _unpacked(
        self, parts: AsyncIterator[bytes], begin: Callable[[], Any]
    ) -> AsyncIterator[bytes]:
        """The unpacked body. Several members may follow one another."""
        stream, piece, size = begin(), bytearray(), 0
        async for part in parts:
            for at in range(0, len(part), self._bodies.slice):
                packed = part[at : at + self._bodies.slice]
                while packed:
                    stream = begin() if stream.eof else stream
                    try:
                        piece += stream.decompress(packed)
                    except (zlib.error, zstandard.ZstdError):
                        raise _damaged() from None
                    packed = stream.unused_data
                if len(piece) > self._bodies.piece:
                    size += len(piece)
                    self._admit(size)
                    yield bytes(piece)
                    piece.clear()
                    await asyncio.sleep(0)  # others have a turn between two pieces of a large body
        if not stream.eof:
            raise _damaged()
        self._admit(size + len(piece))
        yield bytes(piece)


def _damaged() -> InvalidRequest:
    return InvalidRequest([{"loc": ["body"], "msg": _DAMAGED}])
