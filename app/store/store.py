"""The database as routes use it: work on a session, in a thread, with one error for all
failures."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import sqlite3
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from alembic.util import CommandError
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.exc import TimeoutError as PoolTimeout
from sqlalchemy.orm import Session

from joulepath.app.exceptions.stored import StoreFault, StoreUnavailable
from joulepath.app.store.database import (
    OPENED,
    create_database_engine,
    is_writable,
    migrate,
    room_inside,
    sqlite_file,
)
from joulepath.app.store.faults import LEAST_ROOM, DatabaseMoved, fault_of, room
from joulepath.app.store.sqlite_file import Reserve, check, log_size

logger = logging.getLogger(__name__)

T = TypeVar("T")


@dataclass(frozen=True)
class StoreSettings:
    """Settings of the access to the database."""

    threads: int = 4
    """Threads: a statement takes milliseconds, and the connection pool has more connections."""
    long: float = 0.5
    """Time [s] above which a failure is a time-out of a lock or server."""
    pause: float = 1.0
    """Time [s] after a time-out in which all work fails at once, so that clients wait only once."""
    check_period: float = 2.0
    """Time [s] between two checks of the database."""


STORE = StoreSettings()

_UNAVAILABLE = (DBAPIError, PoolTimeout, OSError, CommandError)


class Store:
    """A database, migrated on first contact. `clock` [s] measures the pauses."""

    def __init__(self, url: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._engine = create_database_engine(url)
        self._file = sqlite_file(self._engine.url)
        self._reserve = None if self._file is None else Reserve(self._file)
        self._clock = clock
        self._threads = ThreadPoolExecutor(STORE.threads, thread_name_prefix="store")
        self._migrating = threading.Lock()
        self._migrated = False
        self._was_open = False
        self.pruning = Pruning(clock)
        self._paused: dict[bool, tuple[float, StoreFault]] = {}
        self._checking: asyncio.Task[None] | None = None
        self._told: StoreFault | None = None
        self.fault: StoreFault | None = None
        """The known fault of the database; None after successful access."""

    async def open(self) -> None:
        """Tries to reach the database, and checks it from then on. If a check fails, logs an error
        once.
        """
        await self.check()
        self._checking = asyncio.create_task(self._check_often())

    async def close(self) -> None:
        """Waits for the work in progress, then closes the connections."""
        if self._checking is not None:
            self._checking.cancel()
        await asyncio.to_thread(self._threads.shutdown, cancel_futures=True)
        self._engine.dispose()

    async def check(self) -> None:
        """Brings `fault` up to date, without writing anything."""
        try:
            await asyncio.get_running_loop().run_in_executor(self._threads, self._check)
        except StoreUnavailable as error:
            # `fault` may stem from other work, without a message to the operator.
            if self._told != error.cause:
                self._told = error.cause
                logger.error(
                    "the database cannot be used: requests that need studies or stored answers "
                    "return 503 until it can; all other requests work",
                    extra={"database": str(self), "cause": error.cause},
                )
        else:
            if self._told is not None:
                self._told = None
                logger.info("the database can be used again", extra={"database": str(self)})

    async def read(self, work: Callable[[Session], T]) -> T:
        """The result of `work` on a session. Raises StoreUnavailable."""
        return await asyncio.get_running_loop().run_in_executor(
            self._threads, self._do, work, False
        )

    async def write(self, work: Callable[[Session], T], frees: bool = False) -> T:
        """The result of `work`, after its changes are on the disk.

        If `work` raises, nothing changes. With `frees`, the work deletes data and may use the
        reserved space on a full disk. Raises StoreUnavailable.
        """
        do = self._free if frees else self._write
        return await asyncio.get_running_loop().run_in_executor(self._threads, do, work)

    async def create(self, work: Callable[[Session], T]) -> T:
        """See `write`. The work is done once more if another request or process has just created
        the same: it sees it then."""
        try:
            return await self.write(work)
        except IntegrityError:
            return await self.write(work)

    def __str__(self) -> str:
        return self._engine.url.render_as_string(hide_password=True)

    def _write(self, work: Callable[[Session], T]) -> T:
        try:
            result = self._do(work, True)
        except StoreUnavailable as error:
            if error.cause != "full" or self._file is None:
                raise
            # The space of the log may be sufficient.
            self._empty_log()
            result = self._do(work, True)
        self.fault = None
        return result

    def _free(self, work: Callable[[Session], T]) -> T:
        if self._reserve is None or self._file is None:
            return self._write(work)
        released = False
        try:
            result = self._write(work)
        except StoreUnavailable as error:
            released = error.cause == "full" and self._reserve.release()
            if not released:
                raise
            result = self._write(work)
        with contextlib.suppress(OSError):
            # Deleted space is useful only if log and file can grow.
            if released or (room(self._file) < LEAST_ROOM and self._reserve.release()):
                self._empty_log()
                self._reserve.fill()
        return result

    def _empty_log(self) -> None:
        """Truncates the log of SQLite, unless a reader uses it."""
        with contextlib.suppress(*_UNAVAILABLE, sqlite3.Error):
            connection = self._engine.raw_connection()
            checkpoint = "PRAGMA wal_checkpoint(TRUNCATE)"
            try:
                connection.driver_connection.execute(checkpoint)  # type: ignore[union-attr]
            finally:
                connection.close()

    def _do(self, work: Callable[[Session], T], writes: bool) -> T:
        began = self._clock()
        until, fault = self._paused.get(writes, (began, None))
        if fault is not None and began < until:
            raise StoreUnavailable(fault)
        try:
            self._migrate()
            engine = self._engine.execution_options(writes=writes)
            with Session(engine, expire_on_commit=False) as session:
                with session.begin():
                    opened = session.connection().info.get(OPENED, {})
                    result = work(session)
                check(opened)  # what was committed to a file that is gone is not stored
            return result
        except IntegrityError:
            raise  # the work handles it
        except _UNAVAILABLE as error:
            raise self._failed(error, writes, began) from None

    def _failed(self, error: Exception, writes: bool, began: float) -> StoreUnavailable:
        fault = fault_of(error, self._file)
        # without the statement and its parameters: they hold data of the client
        reason = str(error.orig) if isinstance(error, DBAPIError) else str(error)
        # Log a fault once; failed requests are in the log of requests.
        level = logging.DEBUG if fault == self.fault else logging.ERROR
        logger.log(
            level,
            "database unavailable",
            extra={"database": str(self), "cause": fault, "reason": reason},
        )
        if self._clock() - began > STORE.long:
            self._paused[writes] = self._clock() + STORE.pause, fault
        if fault == "deleted":
            # New connections open the new file.
            self._migrated = False
            self._engine.dispose()
        self.fault = fault
        return StoreUnavailable(fault)

    def _check(self) -> None:
        if not self._do(is_writable, True):
            self.fault = "read-only"
            raise StoreUnavailable("read-only")
        if self._file is not None and self._reserve is not None:
            self._reserve.fill()
            free, inside = room(self._file), self._do(room_inside, False)
            # the log and the file itself both grow
            if free + min(inside, log_size(self._file)) < LEAST_ROOM:
                self.fault = "full"
                raise StoreUnavailable("full")
        self.fault = None

    async def _check_often(self) -> None:
        while True:
            await asyncio.sleep(STORE.check_period)
            await self.check()

    def _migrate(self) -> None:
        with self._migrating:
            if self._migrated:
                return
            if self._was_open and self._file is not None and not self._file.exists():
                # An empty database in place of a missing one, such as a lost volume, would hide the
                # loss.
                raise DatabaseMoved(f"{self._file} is gone")
            migrate(self._engine)
            self._migrated = self._was_open = True
            logger.info("database ready", extra={"database": str(self)})


@dataclass(frozen=True)
class PruningSettings:
    """Settings of the pruning of answers."""

    parts: int = 64
    """Reciprocal of the share freed by a pruning, after whose addition the next one follows."""
    longest: float = 3600.0
    """Longest time [s] between two prunings: answers also grow old."""


PRUNING = PruningSettings()


class Pruning:
    """Counts the bytes added since the last pruning; `clock` [s]. It is thread-safe."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._added = 0
        self._next: float | None = None

    def due(self, added: int, most: int) -> bool:
        """Whether to prune after `added` more bytes, of at most `most`; counts as done if true."""
        with self._lock:
            self._added += added
            if (
                self._next is not None
                and self._clock() < self._next
                and self._added <= most // PRUNING.parts
            ):
                return False
            self._added, self._next = 0, self._clock() + PRUNING.longest
            return True

    def failed(self) -> None:
        """Makes the next pruning due at once, after a failure."""
        with self._lock:
            self._next = None

    @staticmethod
    def target(most: int) -> int:
        """Total after a pruning [byte], so that it stays below `most` until the next one."""
        return most - most // PRUNING.parts
