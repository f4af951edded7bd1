"""The connection to the database: SQLite in a file, or PostgreSQL."""

from __future__ import annotations

import logging
import sqlite3
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url, text

logger = logging.getLogger(__name__)

_MIGRATIONS = Path(__file__).parent / "migrations"
_LOCK_TIMEOUT = 10.0
"""Longest wait [s] of a statement for another process's transaction, and of a connection for its server."""
_MIGRATION_LOCK = 0x6A6F756C65
"""Key of the advisory lock in PostgreSQL: any number that no other program uses in this database."""


def create_database_engine(url: str) -> Engine:
    """SQLAlchemy's engine for `sqlite:///file` or `postgresql://user:password@host/name`. It does not connect yet.

    Raises ArgumentError for any other text.
    """
    parsed = make_url(url)
    if parsed.get_backend_name() == "sqlite":
        return _sqlite(parsed)
    # pg8000: its licence permits redistribution, and it needs no C library
    return create_engine(
        parsed.set(drivername="postgresql+pg8000"),
        connect_args={"timeout": _LOCK_TIMEOUT},
        # after a restart of the server, the connections of the pool are closed
        pool_pre_ping=True,
        pool_timeout=_LOCK_TIMEOUT,
    )


def _sqlite(url: URL) -> Engine:
    engine = create_engine(url, connect_args={"timeout": _LOCK_TIMEOUT}, pool_timeout=_LOCK_TIMEOUT)

    @event.listens_for(engine, "connect")
    def configure(connection: sqlite3.Connection, _: Any) -> None:
        connection.isolation_level = None  # `begin` below starts each transaction, also around DDL
        # FULL: a committed transaction survives a killed process and a power failure
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # without IMMEDIATE, a transaction that reads and then writes fails if another one writes in between
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def migrate(engine: Engine) -> None:
    """Migrates the tables to this version. Several processes may call it at the same time: one works, the others wait.

    Raises CommandError if a later version of the service created the database.
    """
    if engine.url.get_backend_name() == "sqlite" and engine.url.database:
        Path(engine.url.database).parent.mkdir(parents=True, exist_ok=True)
    config = Config()
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    with engine.execution_options(writes=True).begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _MIGRATION_LOCK})
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
