"""Each answer has what lists show of it: its body is not read for that."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0011"
down_revision = "v0010"
branch_labels = None
depends_on = None

_COLUMNS = {"robot": sa.String(64), "energy": sa.Double(), "duration": sa.Double(), "status": sa.String(16)}


def upgrade() -> None:
    """To this revision."""
    for name, kind in _COLUMNS.items():
        op.add_column("answers", sa.Column(name, kind, nullable=True))
    op.create_index("ix_answers_created_id", "answers", ["created", "id"])


def downgrade() -> None:
    """From this revision."""
    op.drop_index("ix_answers_created_id", "answers")
    for name in reversed(_COLUMNS):
        op.drop_column("answers", name)
