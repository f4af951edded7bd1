"""The database as routes use it: work on a session, in a thread, with one error for all failures."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from alembic.util import CommandError
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.exc import TimeoutError as PoolTimeout
from sqlalchemy.orm import Session

from app.exceptions import StoreUnavailable
from app.store.database import create_database_engine, migrate

logger = logging.getLogger(__name__)

T = TypeVar("T")

_THREADS = 4
"""A statement takes milliseconds, so a few threads suffice; the connection pool has more connections than this."""
_UNAVAILABLE = (DBAPIError, PoolTimeout, OSError, CommandError)


class Store:
    """A database, migrated on first contact."""

    def __init__(self, url: str) -> None:
        self._engine = create_database_engine(url)
        self._threads = ThreadPoolExecutor(_THREADS, thread_name_prefix="store")
        self._migrating = threading.Lock()
        self._migrated = False

    async def open(self) -> None:
        """Tries to reach the database. If that fails, logs an error; later work tries again."""
        try:
            await self.read(lambda session: None)
        except StoreUnavailable:
            logger.error(
                "the database cannot be reached: requests that need studies or stored answers return 503 until it "
                "answers; all other requests work",
                extra={"database": str(self)},
            )

    async def close(self) -> None:
        """Waits for the work in progress, then closes the connections."""
        await asyncio.to_thread(self._threads.shutdown, cancel_futures=True)
        self._engine.dispose()

    async def read(self, work: Callable[[Session], T]) -> T:
        """The result of `work` on a session. Raises StoreUnavailable."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, self._do, work, False)

    async def write(self, work: Callable[[Session], T]) -> T:
        """The result of `work`, after its changes are on the disk. If `work` raises, nothing changes.

        Raises StoreUnavailable.
        """
        return await asyncio.get_running_loop().run_in_executor(self._threads, self._do, work, True)

    def __str__(self) -> str:
        return self._engine.url.render_as_string(hide_password=True)

    def _do(self, work: Callable[[Session], T], writes: bool) -> T:
        try:
            self._migrate()
            engine = self._engine.execution_options(writes=writes)
            with Session(engine, expire_on_commit=False) as session, session.begin():
                return work(session)
        except IntegrityError:
            raise  # the work handles it
        except _UNAVAILABLE as error:
            # without the statement and its parameters: they hold data of the client
            reason = str(error.orig) if isinstance(error, DBAPIError) else str(error)
            logger.error("database unavailable", extra={"database": str(self), "reason": reason})
            raise StoreUnavailable from None

    def _migrate(self) -> None:
        if self._migrated:
            return
        with self._migrating:
            if not self._migrated:
                migrate(self._engine)
                self._migrated = True
                logger.info("database ready", extra={"database": str(self)})
