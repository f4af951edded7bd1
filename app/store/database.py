"""The connection to the database: SQLite in a file, or PostgreSQL."""

from __future__ import annotations

import logging
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import URL, Connection, Engine, create_engine, event, inspect, make_url, text
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

from joulepath.app.store.faults import OtherTables, OtherVersion
from joulepath.app.store.sqlite_file import check, identity
from joulepath.app.store.tables import Table

logger = logging.getLogger(__name__)

OPENED = "opened"
"""Key of the identity of a connection's files, in the connection's `info`; empty for PostgreSQL."""
_MIGRATIONS = Path(__file__).parent / "migrations"


@dataclass(frozen=True)
class DatabaseSettings:
    """Time-outs of the database."""

    lock_timeout: float = 2.0
    """Longest wait [s] of a statement for another process's transaction."""
    retry: float = 0.02
    """Time [s] between two attempts for a lock if SQLite does not wait for it."""
    migration_timeout: float = 30.0
    """The same, while another process may be migrating the tables."""
    server_timeout: float = 5.0
    """Longest wait [s] for an answer of PostgreSQL."""


DATABASE = DatabaseSettings()

_PAGES = ("freelist_count", "page_size")
_MIGRATION_LOCK = 0x6A6F756C65
"""Key of the advisory lock in PostgreSQL, different from the keys of other programs."""


def create_database_engine(url: str) -> Engine:
    """SQLAlchemy's engine for `sqlite:///file` or `postgresql://user:password@host/name`. It does
    not connect yet.

    Raises ArgumentError for any other text.
    """
    parsed = make_url(url)
    if parsed.get_backend_name() == "sqlite":
        return _sqlite(parsed)
    return _postgresql(parsed, DATABASE.server_timeout)


def _postgresql(url: URL, timeout: float) -> Engine:
    """An engine with a `timeout` [s] for every answer of the server."""
    # pg8000: its licence permits redistribution, and it needs no C library
    engine = create_engine(
        url.set(drivername="postgresql+pg8000"),
        connect_args={"timeout": timeout},
        # after a restart of the server, the connections of the pool are closed
        pool_pre_ping=True,
        pool_timeout=DATABASE.server_timeout,
    )

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        connection.exec_driver_sql(f"SET LOCAL lock_timeout = {_lock_timeout(connection)}")

    return engine


def sqlite_file(url: URL) -> Path | None:
    """The file of an SQLite database; None for PostgreSQL, and for a database in memory."""
    given = url.database if url.get_backend_name() == "sqlite" else None
    return Path(given) if given and given != ":memory:" and not given.startswith("file:") else None


def _lock_timeout(connection: Connection) -> int:
    """Longest wait for a lock in this transaction [ms]."""
    migrates = connection.get_execution_options().get("migrates", False)
    return int(1000 * (DATABASE.migration_timeout if migrates else DATABASE.lock_timeout))


def _sqlite(url: URL) -> Engine:
    engine = create_engine(url, pool_timeout=DATABASE.lock_timeout)
    file = sqlite_file(url)

    @event.listens_for(engine, "connect")
    def configure(connection: sqlite3.Connection, record: ConnectionPoolEntry) -> None:
        connection.isolation_level = None  # `begin` below starts each transaction, also around DDL
        # FULL: a committed transaction survives a killed process and a power failure.
        # secure_delete=FAST: ON, the default of some builds, needs space for deletions.
        _keep_log(connection)
        for pragma in ("synchronous=FULL", "foreign_keys=ON", "secure_delete=FAST"):
            connection.execute(f"PRAGMA {pragma}")
        connection.execute("SELECT count(*) FROM sqlite_master")  # opens the log, too
        record.info[OPENED] = {} if file is None else identity(file)

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # Without IMMEDIATE, a transaction fails if another one writes between its read and write.
        check(connection.info[OPENED])
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql(f"PRAGMA busy_timeout = {_lock_timeout(connection)}")
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _keep_log(connection: sqlite3.Connection) -> None:
    """Switches the file to a write-ahead log.

    SQLite fails instead of waiting if two processes do so to a new file at once.
    """
    end = time.monotonic() + DATABASE.lock_timeout
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or time.monotonic() > end:
                raise
        time.sleep(DATABASE.retry)


def migrate(engine: Engine) -> None:
    """Migrates the tables to this version; concurrent processes wait for the first one.

    Raises:
        OtherVersion: this version has no migration for the tables.
        OtherTables: the tables are not those of their last migration.
    """
    file = sqlite_file(engine.url)
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
    config = Config()
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    with engine.connect() as connection:
        # Read without a lock, in case the database is read-only.
        present = MigrationContext.configure(connection).get_current_revision()
    scripts = ScriptDirectory.from_config(config)
    if present is not None and present not in {
        script.revision for script in scripts.walk_revisions()
    }:
        raise OtherVersion(present, engine.url)
    if present != scripts.get_current_head():
        with _migrating(engine) as connection:
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
    _check_tables(engine)


def _check_tables(engine: Engine) -> None:
    """Raises OtherTables if a column is missing, as after a restore that was interrupted."""
    found = {
        f"{table}.{column['name']}"
        for (_, table), columns in inspect(engine).get_multi_columns().items()
        for column in columns
    }
    needed = {str(column) for table in Table.metadata.tables.values() for column in table.columns}
    if missing := sorted(needed - found):
        raise OtherTables(missing, engine.url)


@contextmanager
def _migrating(engine: Engine) -> Iterator[Connection]:
    """A transaction with exclusive access to the tables."""
    if engine.dialect.name == "sqlite":
        with engine.execution_options(writes=True, migrates=True).begin() as connection:
            yield connection
        return
    # a connection of the pool would give up on the lock, or on a long change of a table, after
    # `_SERVER_TIMEOUT`
    patient = _postgresql(engine.url, DATABASE.migration_timeout + DATABASE.server_timeout)
    try:
        with patient.execution_options(migrates=True).begin() as connection:
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _MIGRATION_LOCK})
            yield connection
    finally:
        patient.dispose()


def room_inside(session: Session) -> int:
    """Free bytes within the file of an SQLite database."""
    pages, size = (
        session.connection().exec_driver_sql(f"PRAGMA {name}").scalar_one() for name in _PAGES
    )
    return int(pages) * int(size)


def is_writable(session: Session) -> bool:
    """Whether the database takes changes. Nothing is written. Raises DBAPIError, of SQLite also if
    it does not.
    """
    connection = session.connection()
    if connection.dialect.name == "postgresql":
        return str(connection.exec_driver_sql("SHOW transaction_read_only").scalar_one()) == "off"
    # SQLite allows the start of a write transaction on a read-only database.
    connection.exec_driver_sql("UPDATE alembic_version SET version_num = version_num")
    session.rollback()
    return True
