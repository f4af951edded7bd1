"""Motions of moves of rounds, by what was asked."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0013"
down_revision = "v0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    op.create_table(
        "known_motions",
        sa.Column("cell", sa.String(64), nullable=False),
        sa.Column("key", sa.String(64), nullable=False),
        sa.Column("used", sa.DateTime(), nullable=False),
        sa.Column("body", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("cell", "key", name="pk_known_motions"),
    )
    op.create_index("ix_known_motions_cell_used", "known_motions", ["cell", "used"])
    op.create_index("ix_known_motions_used", "known_motions", ["used"])


def downgrade() -> None:
    """From this revision."""
    op.drop_table("known_motions")
