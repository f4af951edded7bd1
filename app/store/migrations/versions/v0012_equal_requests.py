"""What tells each request of a job from others."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0012"
down_revision = "v0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    op.add_column("job_requests", sa.Column("meaning", sa.JSON(), nullable=True))


def downgrade() -> None:
    """From this revision."""
    op.drop_column("job_requests", "meaning")
