"""Alembic's environment: `joulepath.app.store.database.migrate` passes a connection, `alembic
revision` does not.
"""

from __future__ import annotations

from alembic import context
from sqlalchemy import Connection

from joulepath.app.settings import Settings
from joulepath.app.store.database import create_database_engine
from joulepath.app.store.tables import Table


def _run(connection: Connection) -> None:
    # batches, because SQLite alters a table by copying it
    context.configure(connection=connection, target_metadata=Table.metadata, render_as_batch=True)
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is None:
    with create_database_engine(Settings().database_url).connect() as own:
        _run(own)
else:
    _run(given)
