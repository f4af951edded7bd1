"""Figures that were identified on one arm, the studies that use them, and the work that found them."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0009"
down_revision = "v0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    op.create_table(
        "figures",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("robot", sa.String(64), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("owner", sa.String(64), nullable=True),
        sa.Column("content", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_figures"),
    )
    op.create_index("ix_figures_created_id", "figures", ["created", "id"])
    op.add_column("studies", sa.Column("figures", sa.String(36), nullable=True))
    op.add_column("job_requests", sa.Column("figures", sa.String(36), nullable=True))


def downgrade() -> None:
    """From this revision."""
    op.drop_column("job_requests", "figures")
    op.drop_column("studies", "figures")
    op.drop_table("figures")
