"""Answers by the requests that they answer."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0010"
down_revision = "v0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    op.create_table(
        "cached_answers",
        sa.Column("key", sa.String(64), nullable=False),
        sa.Column("answer_id", sa.String(36), nullable=False),
        sa.Column("deadline", sa.Double(), nullable=True),
        sa.PrimaryKeyConstraint("key", name="pk_cached_answers"),
        sa.ForeignKeyConstraint(["answer_id"], ["answers.id"], name="fk_cached_answers_answer_id", ondelete="CASCADE"),
    )
    op.create_index("ix_cached_answers_answer_id", "cached_answers", ["answer_id"])


def downgrade() -> None:
    """From this revision."""
    op.drop_table("cached_answers")
