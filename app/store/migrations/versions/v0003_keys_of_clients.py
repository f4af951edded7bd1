"""An Idempotency-Key belongs to its client: two clients may choose the same one."""

from __future__ import annotations

import hashlib

import sqlalchemy as sa
from alembic import op

revision = "keys_of_clients"
down_revision = "owners_of_requests"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Converts the keys of clients into the form of this version."""
    connection = op.get_bind()
    for name in ("jobs", "studies"):
        table = sa.table(name, *map(sa.column, ("id", "owner", "idempotency_key")))
        keys = sa.select(table).where(table.c.owner.is_not(None))
        for row in connection.execute(keys.where(table.c.idempotency_key.is_not(None))).all():
            own = hashlib.sha256(f"{row.owner} {row.idempotency_key}".encode()).hexdigest()
            change = sa.update(table).where(table.c.id == row.id)
            connection.execute(change.values(idempotency_key=own))
