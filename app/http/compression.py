"""Compression of answers by `Accept-Encoding` (RFC 9110, section 12.5.3).

Starlette's own middleware ignores the weights, knows no zstd, and leaves a strong entity tag as it
is.
"""

from __future__ import annotations

import asyncio
import gzip
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import zstandard
from starlette.datastructures import MutableHeaders
from starlette.types import Message

from joulepath.app.exceptions.transport import NotAcceptable
from joulepath.app.http.weights import weights

Coding = Literal["zstd", "gzip", "identity"]


@dataclass(frozen=True)
class Compression:
    """Settings of compression."""

    offered: tuple[Coding, ...] = ("zstd", "gzip")
    """Codings by preference for equal weights."""
    zstd_level: int = 3
    gzip_level: int = 5
    file_zstd_level: int = 12
    """Level for files with an entity tag, which are compressed once and sent often."""
    file_gzip_level: int = 9
    least: int = 1024
    """Smaller bodies fit into one packet anyway [byte]."""
    instant: int = 1 << 15
    """Largest body compressed in the event loop [byte], faster than a thread could start."""
    kinds: tuple[str, ...] = (
        "text/",
        "application/json",
        "application/problem+json",
        "application/javascript",
        "model/",
    )
    """Prefixes of compressed media types."""

    def preferred(self, header: str) -> Coding:
        """The coding of greatest weight; `identity` stands for none.

        Malformed members of the header are ignored. Raises NotAcceptable without an acceptable
        coding.
        """
        given = {
            {"x-gzip": "gzip"}.get(name, name): weight for name, weight in weights(header).items()
        }
        anything = given.get("*")
        # no coding is allowed unless it is excluded, and the least wanted unless it is named
        plain = given.get("identity", 0.0 if anything == 0 else None)
        wanted = {coding: given.get(coding, anything or 0.0) for coding in self.offered}
        best = max(self.offered, key=wanted.__getitem__)
        if wanted[best] > 0 and (plain is None or plain <= wanted[best]):
            return best
        if plain == 0:
            raise NotAcceptable
        return "identity"

    async def encoded(self, start: Message, first: Message, coding: Coding) -> Message:
        """The first message of a body, compressed if it is complete; adapts the headers in
        `start`."""
        headers = MutableHeaders(scope=start)
        if (
            not headers.get("content-type", "").startswith(self.kinds)
            or "content-encoding" in headers
        ):
            return first
        headers.add_vary_header("Accept-Encoding")
        body: bytes = first.get("body", b"")
        if coding == "identity" or first.get("more_body", False) or len(body) < self.least:
            return first
        if "etag" in headers:
            level = self.file_zstd_level if coding == "zstd" else self.file_gzip_level
            body = await asyncio.to_thread(_compressed_file, body, coding, level)
        else:
            level = self.zstd_level if coding == "zstd" else self.gzip_level
            if len(body) < self.instant:
                body = _compressed(body, coding, level)
            else:
                body = await asyncio.to_thread(_compressed, body, coding, level)
        headers["Content-Encoding"] = coding
        headers["Content-Length"] = str(len(body))
        if headers.get("etag", "").startswith('"'):  # the same answer, but not the same bytes
            headers["ETag"] = f"W/{headers['etag']}"
        return {**first, "body": body}


def _compressed(body: bytes, coding: Coding, level: int) -> bytes:
    if coding == "zstd":  # a compressor may not be shared by threads
        return zstandard.ZstdCompressor(level=level).compress(body)
    return gzip.compress(body, level, mtime=0)


_compressed_file = lru_cache(maxsize=64)(_compressed)
