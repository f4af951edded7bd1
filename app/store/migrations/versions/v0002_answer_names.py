"""Names of answers, and which answers are parts of others."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "answer_names"
down_revision = "initial"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Adds both columns. Parts that are already kept are listed with the others."""
    op.add_column("answers", sa.Column("name", sa.String(200), nullable=True))
    op.add_column(
        "answers", sa.Column("is_part", sa.Boolean(), nullable=False, server_default=sa.false())
    )


def downgrade() -> None:
    """Removes both columns."""
    op.drop_column("answers", "is_part")
    op.drop_column("answers", "name")
