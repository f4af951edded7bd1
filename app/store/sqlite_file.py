"""The file of an SQLite database: its identity, and space reserved for deletions.

A connection stays on its open file even after the file is deleted or replaced: it would then
acknowledge lost data.
"""

from __future__ import annotations

import contextlib
import logging
import os
from dataclasses import dataclass
from pathlib import Path

from joulepath.app.store.faults import DatabaseMoved, room

logger = logging.getLogger(__name__)

Identity = dict[Path, tuple[int, int] | None]
"""Device and number of the database's file and of its write-ahead log."""


@dataclass(frozen=True)
class ReserveSettings:
    """Space reserved for deletions."""

    bytes: int = 8 << 20
    """Reserved bytes. A deletion writes one page per thousand freed pages: enough for gigabytes."""
    smallest: int = 1 << 20
    """Least reserve [byte]; with less free space there is none."""


RESERVE = ReserveSettings()


def identity(file: Path) -> Identity:
    """Identity of the files opened by a connection, after its first read has opened the log."""
    return {path: _number(path) for path in (file, Path(f"{file}-wal"))}


def log_size(file: Path) -> int:
    """Size of the write-ahead log [byte], including reusable space."""
    try:
        return Path(f"{file}-wal").stat().st_size
    except OSError:
        return 0


def check(opened: Identity) -> None:
    """Raises DatabaseMoved if the files at their paths have changed since they were opened."""
    for path, number in opened.items():
        if _number(path) != number:
            raise DatabaseMoved(f"{path} is gone, or is another file than the one that was opened")


def _number(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


class Reserve:
    """A file of unused bytes beside the database. SQLite needs space to delete: without it, a full
    disk stays full.
    """

    def __init__(self, database: Path) -> None:
        self._path = Path(f"{database}.reserve")

    def fill(self) -> None:
        """Reserves `_RESERVE` bytes, at most half of the free space: the log needs room as well."""
        with contextlib.suppress(OSError):
            held = self._path.stat().st_size if self._path.exists() else 0
            size = min(RESERVE.bytes, (room(self._path) + held) // 2)
            if size >= max(RESERVE.smallest, 2 * held):
                self._path.unlink(missing_ok=True)
                self._take(size)

    def release(self) -> bool:
        """Gives the bytes back to the disk; whether there were any."""
        try:
            self._path.unlink()
        except OSError:
            return False
        logger.warning(
            "the disk is full: the reserve for deleting is in use",
            extra={"reserve": str(self._path)},
        )
        return True

    def _take(self, size: int) -> None:
        descriptor = os.open(self._path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o600)
        try:
            os.posix_fallocate(descriptor, 0, size)
        except OSError:
            self._path.unlink(missing_ok=True)
        finally:
            os.close(descriptor)
