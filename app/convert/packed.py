"""Compressed documents of the database; one may have a hundred megabytes."""

from __future__ import annotations

import zstandard

_LEVEL = 1
"""Of Zstandard: on documents of numbers its higher levels are slower, and no smaller."""


def packed(document: bytes) -> bytes:
    """A document, compressed."""
    # a compressor may not be shared by threads
    return zstandard.ZstdCompressor(level=_LEVEL).compress(document)


def unpacked(kept: bytes) -> bytes:
    """The document."""
    return zstandard.ZstdDecompressor().decompress(kept)
