"""Requests of jobs have the owner of their job, because owners take turns."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "owners_of_requests"
down_revision = "initial"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Adds the column with the owners of the jobs, and sorts the index by it."""
    # For a time, the first migration made the column itself.
    if "owner" in {each["name"] for each in sa.inspect(op.get_bind()).get_columns("job_requests")}:
        return
    op.add_column("job_requests", sa.Column("owner", sa.String(64), nullable=True))
    op.execute(
        "UPDATE job_requests SET owner = (SELECT jobs.owner FROM jobs WHERE jobs.id = job_id)"
    )
    op.drop_index("ix_job_requests_state_number_job_id", "job_requests")
    op.create_index(
        "ix_job_requests_state_owner_number_job_id",
        "job_requests",
        ["state", "owner", "number", "job_id"],
    )
