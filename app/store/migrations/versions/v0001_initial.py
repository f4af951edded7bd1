"""All tables of the first release."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "initial"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """From an empty database."""
    _figures()
    _jobs()
    _known_motions()
    _logs()
    _robots()
    _studies()
    _answers()
    _job_events()
    _cached_answers()
    _iterations()
    _job_requests()


def _figures() -> None:
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


def _jobs() -> None:
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("name", sa.String(200), nullable=True),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("owner", sa.String(64), nullable=True),
        sa.Column("keep_going", sa.Boolean(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("started", sa.DateTime(), nullable=True),
        sa.Column("ended", sa.DateTime(), nullable=True),
        sa.Column("total", sa.Integer(), nullable=False),
        sa.Column("ended_before", sa.Integer(), nullable=False),
        sa.Column("events", sa.Integer(), nullable=False),
        sa.Column("progressed", sa.DateTime(), nullable=True),
        sa.Column("idempotency_key", sa.String(128), nullable=True),
        sa.Column("fingerprint", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_jobs"),
        sa.UniqueConstraint("idempotency_key", name="uq_jobs_idempotency_key"),
    )
    op.create_index("ix_jobs_created_id", "jobs", ["created", "id"])
    op.create_index("ix_jobs_ended", "jobs", ["ended"])


def _known_motions() -> None:
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


def _logs() -> None:
    op.create_table(
        "logs",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("name", sa.String(200), nullable=True),
        sa.Column("robot", sa.String(64), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("owner", sa.String(64), nullable=True),
        sa.Column("settings", sa.JSON(), nullable=False),
        sa.Column("report", sa.JSON(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("body", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_logs"),
    )
    op.create_index("ix_logs_created_id", "logs", ["created", "id"])


def _robots() -> None:
    op.create_table(
        "robots",
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("owner", sa.String(64), nullable=True),
        sa.Column("figures", sa.JSON(), nullable=False),
        sa.Column("warnings", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_robots"),
    )


def _studies() -> None:
    op.create_table(
        "studies",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("robot", sa.String(64), nullable=False),
        sa.Column("objective", sa.String(32), nullable=False),
        sa.Column("threshold", sa.Double(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("owner", sa.String(64), nullable=True),
        sa.Column("idempotency_key", sa.String(128), nullable=True),
        sa.Column("figures", sa.String(36), nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_studies"),
        sa.UniqueConstraint("idempotency_key", name="uq_studies_idempotency_key"),
    )
    op.create_index("ix_studies_created_id", "studies", ["created", "id"])


def _answers() -> None:
    op.create_table(
        "answers",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("owner", sa.String(64), nullable=True),
        sa.Column("study_id", sa.String(36), nullable=True),
        sa.Column("job_id", sa.String(36), nullable=True),
        sa.Column("robot", sa.String(64), nullable=True),
        sa.Column("energy", sa.Double(), nullable=True),
        sa.Column("duration", sa.Double(), nullable=True),
        sa.Column("status", sa.String(16), nullable=True),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("body", sa.LargeBinary(), nullable=False),
        sa.Column("request", sa.LargeBinary(), nullable=True),
        sa.Column("name", sa.String(200), nullable=True),
        sa.Column("typed", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("is_part", sa.Boolean(), server_default=sa.false(), nullable=False),
        sa.ForeignKeyConstraint(
            ["study_id"], ["studies.id"], name="fk_answers_study_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_answers"),
    )
    op.create_index("ix_answers_created_id", "answers", ["created", "id"])
    op.create_index("ix_answers_created_size", "answers", ["created", "size"])
    op.create_index("ix_answers_job_id", "answers", ["job_id"])
    op.create_index("ix_answers_study_id", "answers", ["study_id"])


def _job_events() -> None:
    op.create_table(
        "job_events",
        sa.Column("job_id", sa.String(36), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("name", sa.String(16), nullable=False),
        sa.Column("data", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["job_id"], ["jobs.id"], name="fk_job_events_job_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job_id", "number", name="pk_job_events"),
    )


def _cached_answers() -> None:
    op.create_table(
        "cached_answers",
        sa.Column("key", sa.String(64), nullable=False),
        sa.Column("answer_id", sa.String(36), nullable=False),
        sa.Column("deadline", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["answer_id"], ["answers.id"], name="fk_cached_answers_answer_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("key", name="pk_cached_answers"),
    )
    op.create_index("ix_cached_answers_answer_id", "cached_answers", ["answer_id"])


def _iterations() -> None:
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
        sa.Column("best", sa.Integer(), nullable=False),
        sa.Column("met_by", sa.Integer(), nullable=True),
        sa.Column("idempotency_key", sa.String(128), nullable=True),
        sa.ForeignKeyConstraint(["answer_id"], ["answers.id"], name="fk_iterations_answer_id"),
        sa.ForeignKeyConstraint(
            ["study_id"], ["studies.id"], name="fk_iterations_study_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("study_id", "number", name="pk_iterations"),
        sa.UniqueConstraint("answer_id", name="uq_iterations_answer_id"),
    )
    op.create_index(
        "ix_iterations_study_id_idempotency_key",
        "iterations",
        ["study_id", "idempotency_key"],
        unique=True,
    )


def _job_requests() -> None:
    op.create_table(
        "job_requests",
        sa.Column("job_id", sa.String(36), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("name", sa.String(200), nullable=True),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("deadline", sa.Double(), nullable=False),
        sa.Column("body", sa.LargeBinary(), nullable=False),
        sa.Column("meaning", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("deaths", sa.Integer(), nullable=False),
        sa.Column("preempted", sa.Integer(), nullable=False),
        sa.Column("leased_by", sa.String(128), nullable=True),
        sa.Column("leased_until", sa.DateTime(), nullable=True),
        sa.Column("wall_time", sa.Double(), nullable=True),
        sa.Column("energy", sa.Double(), nullable=True),
        sa.Column("duration", sa.Double(), nullable=True),
        sa.Column("status", sa.String(16), nullable=True),
        sa.Column("answer_id", sa.String(36), nullable=True),
        sa.Column("problem", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("figures", sa.String(36), nullable=True),
        sa.ForeignKeyConstraint(["answer_id"], ["answers.id"], name="fk_job_requests_answer_id"),
        sa.ForeignKeyConstraint(
            ["job_id"], ["jobs.id"], name="fk_job_requests_job_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job_id", "number", name="pk_job_requests"),
        sa.UniqueConstraint("answer_id", name="uq_job_requests_answer_id"),
    )
    op.create_index("ix_job_requests_job_id_state", "job_requests", ["job_id", "state"])
    op.create_index(
        "ix_job_requests_state_number_job_id", "job_requests", ["state", "number", "job_id"]
    )
