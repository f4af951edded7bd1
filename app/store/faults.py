"""Faults of the database, by the errors of its driver."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

from alembic.util import CommandError
from sqlalchemy import URL
from sqlalchemy.exc import DBAPIError

from joulepath.app.exceptions.stored import StoreFault

LEAST_ROOM = 1 << 20
"""Below this many free bytes the disk counts as full: a commit of an ordinary answer may fail."""

# https://sqlite.org/rescode.html: the first 8 bits of a result code are its kind
_SQLITE: dict[int, StoreFault] = {
    1: "damaged",  # of a statement: a table or column is missing, or is there already
    5: "locked",
    6: "locked",
    8: "read-only",
    11: "damaged",
    13: "full",
    26: "damaged",
}
_SQLITE_IO_ERROR = 10
_FILES: dict[int, StoreFault] = {errno.ENOSPC: "full", errno.EROFS: "read-only"}
# https://www.postgresql.org/docs/current/errcodes-appendix.html
_POSTGRESQL: dict[str, StoreFault] = {
    "25006": "read-only",
    "42703": "damaged",
    "42P01": "damaged",
    "42P07": "damaged",
    "53100": "full",
    "55P03": "locked",
    "XX001": "damaged",
    "XX002": "damaged",
}


class DatabaseMoved(OSError):
    """The file of the database was replaced after it was opened."""


class OtherVersion(CommandError):
    """The database belongs to another version of the service; `revision` of its tables."""

    def __init__(self, revision: str, url: URL) -> None:
        super().__init__(
            f"Another version of the service made the tables of {url.render_as_string()} (revision "
            f"{revision}), and this one cannot migrate them: start that version, or move the "
            "database away (or set another JOULEPATH_DATABASE_URL), and a new one is made."
        )


class OtherTables(CommandError):
    """The tables lack columns that the migrations make; `missing` are names with their table."""

    def __init__(self, missing: list[str], url: URL) -> None:
        super().__init__(
            f"The tables of {url.render_as_string()} are not as this service makes them, since "
            f"they lack {', '.join(missing)}: restore a backup, or move the database away (or set "
            "another JOULEPATH_DATABASE_URL), and a new one is made."
        )


def fault_of(error: Exception, file: Path | None) -> StoreFault:
    """The fault behind an error of the driver; `file` is the file of an SQLite database."""
    if isinstance(error, DatabaseMoved):
        return "deleted"
    if isinstance(error, OtherVersion):
        return "other-version"
    if isinstance(error, OtherTables):
        return "damaged"
    if isinstance(error, OSError) and error.errno in _FILES:
        return _FILES[error.errno]
    if not isinstance(error, DBAPIError):
        return "unreachable"
    code = getattr(error.orig, "sqlite_errorcode", None)
    if code is not None:
        # On a full disk, the memory map beside the file reports an I/O error.
        full = code & 0xFF == _SQLITE_IO_ERROR and file is not None and room(file) < LEAST_ROOM
        return "full" if full else _SQLITE.get(code & 0xFF, "unreachable")
    told: Any = error.orig.args[0] if error.orig is not None and error.orig.args else None
    return (
        _POSTGRESQL.get(told.get("C", ""), "unreachable")
        if isinstance(told, dict)
        else "unreachable"
    )


def room(file: Path) -> int:
    """Free bytes of the file system of `file`. Raises OSError."""
    free = os.statvfs(file.parent)
    return free.f_bavail * free.f_frsize
