"""Files read from pieces of bytes of any size."""

from __future__ import annotations

from collections.abc import Callable
from io import RawIOBase
from typing import Any


class PieceReader(RawIOBase):
    """A readable binary file over a source of pieces.

    Args:
        next_piece: returns the next piece, of any size, for a requested number of bytes; returns
            an empty piece at the end of the file.
        close: closes the source of the pieces.
    """

    def __init__(
        self, next_piece: Callable[[int], bytes], close: Callable[[], object] | None = None
    ) -> None:
        self._next_piece, self._close = next_piece, close
        self._rest = b""

    def readable(self) -> bool:
        """Always true."""
        return True

    def readinto(self, buffer: Any, /) -> int:
        """Read into a buffer; raises the errors of the pieces."""
        view = memoryview(buffer)
        piece = self._rest or self._next_piece(len(view))
        count = min(len(view), len(piece))
        view[:count], self._rest = piece[:count], piece[count:]
        return count

    def close(self) -> None:
        """Close the file."""
        if self._close is not None:
            self._close()
        super().close()
