"""Unpacks bodies that are sent with `Content-Encoding: gzip`, `deflate` or `zstd`, a piece at a time."""

from __future__ import annotations

import asyncio
import zlib
from collections.abc import Callable
from functools import partial
from typing import Protocol

import zstandard
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from joulepath.app.exceptions import InvalidRequest, UnsupportedCoding
from joulepath.app.http.refused_body import RefusedBody

_PIECE = 1 << 16
"""Bytes that are unpacked at a time: what a body takes at most before its size is checked."""
_SLICE = 128
"""Bytes that zstd gets at a time, since it takes no limit of what they unpack to: a block of four can be 128 KiB."""
_WINDOW = 1 << 23
"""Memory [byte] that a zstd frame may ask for: what RFC 8878 asks decoders to support."""
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
        if coding in _STREAMS:
            for name in ("content-encoding", "content-length"):
                if name in headers:
                    del headers[name]
            scope = {**scope, "headers": headers.raw}
            receive = _Unpacked(receive, _STREAMS[coding])
        else:
            receive = _refuse
        await self._app(scope, receive, send)


async def _refuse() -> Message:
    raise RefusedBody(UnsupportedCoding())


class _Stream(Protocol):
    """What `zlib.decompressobj` makes."""

    @property
    def eof(self) -> bool: ...
    @property
    def unused_data(self) -> bytes: ...
    @property
    def unconsumed_tail(self) -> bytes: ...
    def decompress(self, data: bytes, max_length: int, /) -> bytes: ...


class _Zstd:
    """A frame of zstd. A piece may be longer than asked for by what one slice unpacks to, some 4 MiB."""

    def __init__(self) -> None:
        self._stream = zstandard.ZstdDecompressor(max_window_size=_WINDOW).decompressobj()
        self.unconsumed_tail = b""

    @property
    def eof(self) -> bool:
        """Whether the frame is complete."""
        return self._stream.eof

    @property
    def unused_data(self) -> bytes:
        """What comes after the frame."""
        return self._stream.unused_data + self.unconsumed_tail

    def decompress(self, data: bytes, max_length: int) -> bytes:
        """The next piece. Raises ZstdError."""
        pieces, size, at = [], 0, 0
        while at < len(data) and size < max_length and not self._stream.eof:
            pieces.append(self._stream.decompress(data[at : at + _SLICE]))
            size += len(pieces[-1])
            at += _SLICE
        self.unconsumed_tail = data[at:]
        return b"".join(pieces)


_STREAMS: dict[str, Callable[[], _Stream]] = {
    "gzip": partial(zlib.decompressobj, 31),
    "x-gzip": partial(zlib.decompressobj, 31),
    "deflate": partial(zlib.decompressobj, 15),
    "zstd": _Zstd,
}


class _Unpacked:
    """Messages of a request whose body is unpacked: one piece each."""

    def __init__(self, receive: Receive, begin: Callable[[], _Stream]) -> None:
        self._receive = receive
        self._begin = begin
        self._stream = begin()
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
            self._stream = self._begin()
        try:
            piece = self._stream.decompress(self._packed, _PIECE)
        except (zlib.error, zstandard.ZstdError):
            raise RefusedBody(InvalidRequest([{"loc": ["body"], "msg": _DAMAGED}])) from None
        self._packed = self._stream.unused_data if self._stream.eof else self._stream.unconsumed_tail
        return piece
