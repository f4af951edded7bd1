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
"""How long a statement waits for another process's transaction, and a connection for its server [s]."""
_MIGRATION_LOCK = 0x6A6F756C65
"""Any number that no other user of a PostgreSQL database takes for its advisory lock."""


def create_database_engine(url: str) -> Engine:
    """SQLAlchemy's engine for `sqlite:///file` or `postgresql://user:password@host/name`. It does not connect yet.

    Raises ArgumentError for what is no such URL.
    """
    parsed = make_url(url)
    if parsed.get_backend_name() == "sqlite":
        return _sqlite(parsed)
    # pg8000 has a licence that lets anyone ship it, and needs no C library
    return create_engine(
        parsed.set(drivername="postgresql+pg8000"),
        connect_args={"timeout": _LOCK_TIMEOUT},
        # a server that was restarted has dropped the pool's connections
        pool_pre_ping=True,
        pool_timeout=_LOCK_TIMEOUT,
    )


def _sqlite(url: URL) -> Engine:
    engine = create_engine(url, connect_args={"timeout": _LOCK_TIMEOUT}, pool_timeout=_LOCK_TIMEOUT)

    @event.listens_for(engine, "connect")
    def configure(connection: sqlite3.Connection, _: Any) -> None:
        connection.isolation_level = None  # `begin` below says when a transaction starts, also around DDL
        # FULL: what has been committed survives a killed process and a power cut alike
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # one that reads first and writes later would be refused, not made to wait, if another wrote in between
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def migrate(engine: Engine) -> None:
    """Brings the tables up to date. Safe when several processes do it at once: one works, the others wait.

    Raises CommandError when the database was made by a later version of the service.
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
