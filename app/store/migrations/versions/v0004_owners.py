"""Who created a study, a robot or an answer."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0004"
down_revision = "v0002"
branch_labels = None
depends_on = None

_TABLES = ("studies", "robots", "answers")


def upgrade() -> None:
    """To this revision. What is there was created without a key, and has no owner."""
    for table in _TABLES:
        op.add_column(table, sa.Column("owner", sa.String(64), nullable=True))


def downgrade() -> None:
    """From this revision."""
    for table in _TABLES:
        with op.batch_alter_table(table) as batch:
            batch.drop_column("owner")
