"""Studies, their iterations, and answers."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    op.create_table(
        "studies",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("robot", sa.String(64), nullable=False),
        sa.Column("objective", sa.String(32), nullable=False),
        sa.Column("threshold", sa.Double(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("idempotency_key", sa.String(128), nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_studies"),
        sa.UniqueConstraint("idempotency_key", name="uq_studies_idempotency_key"),
    )
    op.create_index("ix_studies_created_id", "studies", ["created", "id"])
    op.create_table(
        "answers",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("study_id", sa.String(36), nullable=True),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("body", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_answers"),
        sa.ForeignKeyConstraint(["study_id"], ["studies.id"], name="fk_answers_study_id", ondelete="CASCADE"),
    )
    op.create_index("ix_answers_created_size", "answers", ["created", "size"])
    op.create_index("ix_answers_study_id", "answers", ["study_id"])
    op.create_table(
        "iterations",
        sa.Column("study_id", sa.String(36), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("request", sa.JSON(), nullable=False),
        sa.Column("answer_id", sa.String(36), nullable=False),
        sa.Column("duration", sa.Double(), nullable=False),
        sa.Column("electrical", sa.Double(), nullable=False),
        sa.Column("mechanical", sa.Double(), nullable=False),
        sa.Column("idempotency_key", sa.String(128), nullable=True),
        sa.PrimaryKeyConstraint("study_id", "number", name="pk_iterations"),
        sa.ForeignKeyConstraint(["study_id"], ["studies.id"], name="fk_iterations_study_id", ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["answer_id"], ["answers.id"], name="fk_iterations_answer_id"),
        sa.UniqueConstraint("answer_id", name="uq_iterations_answer_id"),
    )
    op.create_index(
        "ix_iterations_study_id_idempotency_key", "iterations", ["study_id", "idempotency_key"], unique=True
    )


def downgrade() -> None:
    """Back to an empty database."""
    for name in ("iterations", "answers", "studies"):
        op.drop_table(name)
