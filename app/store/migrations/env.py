"""Alembic's door: `app.store.migrate` comes in with a connection, `alembic revision --autogenerate` without one."""

from __future__ import annotations

from alembic import context
from sqlalchemy import Connection

from app.settings import Settings
from app.store.database import create_database_engine
from app.store.tables import Table


def _run(connection: Connection) -> None:
    # batches: SQLite alters a table by copying it
    context.configure(connection=connection, target_metadata=Table.metadata, render_as_batch=True)
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is None:
    with create_database_engine(Settings().database_url).connect() as own:
        _run(own)
else:
    _run(given)
