"""The tables in SQLAlchemy. `migrations/` creates them, and a test compares both."""

from __future__ import annotations

import re
import secrets
import time
import uuid
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any, TypeVar

from sqlalchemy import (
    JSON,
    DateTime,
    Dialect,
    ForeignKey,
    Index,
    LargeBinary,
    MetaData,
    String,
    TypeDecorator,
    false,
)
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column

from joulepath.app.access.client import Client, check_owner
from joulepath.app.schemas.lengths import LENGTHS

T = TypeVar("T", bound="Owned")
# SQLite can alter a constraint only if it has a name
_NAMES = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s",
    "pk": "pk_%(table_name)s",
}


def now() -> datetime:
    """The present time in UTC."""
    return datetime.now(UTC)


def new_id() -> str:
    """A unique id for a row (UUID of version 7, RFC 9562).

    Ids that are made later sort later, to the millisecond: jobs take turns in the order in which
    they came.
    """
    milliseconds = time.time_ns() // 1_000_000
    version, variant = 7 << 76 | secrets.randbits(12) << 64, 2 << 62 | secrets.randbits(62)
    return str(uuid.UUID(int=milliseconds << 80 | version | variant))


def by_id(
    session: Session,
    table: type[T],
    id: str,
    unknown: Callable[[], Exception],
    client: Client | None = None,
    **how: Any,
) -> T:
    """The row with an id. Raises `unknown`, and NotOwner if a client may not change it.

    Args:
        session: the session.
        table: the table, whose key is the id alone.
        id: the id, or any other text; PostgreSQL rejects some other texts with an error.
        unknown: makes the error if there is no such row.
        client: who wants to change the row; None: it is only read.
        how: options of `Session.get`.
    """
    row = session.get(table, id, **how) if re.fullmatch(r"[0-9a-f-]{36}", id) else None
    if row is None:
        raise unknown()
    if client is not None:
        check_owner(client, row.owner)
    return row


def insert_new(session: Session, table: type[Table], rows: list[dict[str, Any]]) -> None:
    """Adds rows; another process may just have added some of them, which stay as they are."""
    is_postgresql = session.get_bind().dialect.name == "postgresql"
    insert = postgresql.insert(table) if is_postgresql else sqlite.insert(table)
    session.execute(insert.on_conflict_do_nothing(), rows)


class Instant(TypeDecorator[datetime]):
    """A time in UTC. The column has no time zone, because SQLite does not store one."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """To the database."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """From the database."""
        return None if value is None else value.replace(tzinfo=UTC)


class Table(DeclarativeBase):
    """Base of the tables. A column `owner` is the name of the creator's API key, or null."""

    metadata = MetaData(naming_convention=_NAMES)


class Owned(Table):
    """A table of the objects of clients."""

    __abstract__ = True

    id: Mapped[str] = mapped_column(String(LENGTHS.id), primary_key=True)
    created: Mapped[datetime] = mapped_column(Instant)
    owner: Mapped[str | None] = mapped_column(String(LENGTHS.owner))


class Study(Owned):
    """Iterative improvement of a motion until its energy is at most `threshold` [J]."""

    __tablename__ = "studies"
    __table_args__ = (Index(None, "created", "id"),)

    name: Mapped[str] = mapped_column(String(LENGTHS.name))
    robot: Mapped[str] = mapped_column(String(LENGTHS.robot))
    objective: Mapped[str] = mapped_column(String(32))
    threshold: Mapped[float]
    idempotency_key: Mapped[str | None] = mapped_column(String(LENGTHS.key), unique=True)
    figures: Mapped[str | None] = mapped_column(String(LENGTHS.id))
    """Id of the figures of all iterations; null for the robot's own."""


class OwnRobot(Table):
    """An added robot: figures in the form of a bundled robot's file, and warnings."""

    __tablename__ = "robots"

    name: Mapped[str] = mapped_column(String(LENGTHS.robot), primary_key=True)
    created: Mapped[datetime] = mapped_column(Instant)
    owner: Mapped[str | None] = mapped_column(String(LENGTHS.owner))
    figures: Mapped[dict[str, Any]] = mapped_column(JSON)
    warnings: Mapped[list[str]] = mapped_column(JSON)


class StoredLog(Owned):
    """A log of one arm: the file of the user, packed with gzip, and the `settings` of its
    reader."""

    __tablename__ = "logs"
    __table_args__ = (Index(None, "created", "id"),)

    name: Mapped[str | None] = mapped_column(String(LENGTHS.name))
    robot: Mapped[str] = mapped_column(String(LENGTHS.robot))
    settings: Mapped[dict[str, Any]] = mapped_column(JSON)
    report: Mapped[dict[str, Any]] = mapped_column(JSON)
    """Fields of the report without a column of their own."""
    size: Mapped[int]
    """Size of the body [byte]."""
    body: Mapped[bytes] = mapped_column(LargeBinary)


class Figures(Owned):
    """Figures identified on one arm, replacing the robot's own.

    The id is made of robot and content: the same figures have the same id on every server.
    """

    __tablename__ = "figures"
    __table_args__ = (Index(None, "created", "id"),)

    robot: Mapped[str] = mapped_column(String(LENGTHS.robot))
    content: Mapped[dict[str, Any]] = mapped_column(JSON)


class Answer(Owned):
    """A complete answer of an endpoint: JSON, compressed. An answer of a study or job is deleted
    with it, any other by age and total size."""

    __tablename__ = "answers"
    # the first for the sum of sizes from the newest on, the second for the list: without reading
    # the bodies
    __table_args__ = (
        Index(None, "created", "size"),
        Index(None, "created", "id"),
        Index(None, "study_id"),
        Index(None, "job_id"),
    )

    kind: Mapped[str] = mapped_column(String(32))
    study_id: Mapped[str | None] = mapped_column(ForeignKey("studies.id", ondelete="CASCADE"))
    job_id: Mapped[str | None] = mapped_column(String(LENGTHS.id))
    """Whoever deletes a job deletes its answers."""
    robot: Mapped[str | None] = mapped_column(String(LENGTHS.robot))
    """With the next three columns, the figures in lists; null without one."""
    energy: Mapped[float | None]
    duration: Mapped[float | None]
    status: Mapped[str | None] = mapped_column(String(16))
    size: Mapped[int]
    """Size of the compressed body and request, and of `typed` [byte]."""
    body: Mapped[bytes] = mapped_column(LargeBinary)
    request: Mapped[bytes | None] = mapped_column(LargeBinary)
    """The request as it was sent: JSON, compressed. Those of jobs and studies are with these."""
    name: Mapped[str | None] = mapped_column(String(LENGTHS.name))
    typed: Mapped[dict[str, str] | None] = mapped_column(JSON(none_as_null=True))
    """Texts in which the numbers of the request were typed, by JSON pointers."""
    is_part: Mapped[bool] = mapped_column(server_default=false())
    """Whether the answer is a motion of another answer: of a cycle, of a front, of what-if."""


class CachedAnswer(Table):
    """The answer to a request; `key` is the hash of its canonical form."""

    __tablename__ = "cached_answers"
    __table_args__ = (Index(None, "answer_id"),)

    key: Mapped[str] = mapped_column(String(64), primary_key=True)
    answer_id: Mapped[str] = mapped_column(ForeignKey("answers.id", ondelete="CASCADE"))
    deadline: Mapped[float | None]
    """Longest deadline [s] of a request with this answer; null for an optimal answer."""


class KnownMotion(Table):
    """A motion of a move of a cycle. Cycles of the same arm in the same `cell` may have it in
    common.
    """

    __tablename__ = "known_motions"
    __table_args__ = (Index(None, "cell", "used"), Index(None, "used"))

    cell: Mapped[str] = mapped_column(String(64), primary_key=True)
    """Hash of the arm and the cell of a cycle."""
    key: Mapped[str] = mapped_column(String(64), primary_key=True)
    """Hash of everything on which the motion depends."""
    used: Mapped[datetime] = mapped_column(Instant)
    body: Mapped[bytes] = mapped_column(LargeBinary)
    """The spline: JSON, compressed."""


class Iteration(Table):
    """One step of a study: the request and the energies [J] of its motion. The complete answer is
    in `answers`.
    """

    __tablename__ = "iterations"
    __table_args__ = (Index(None, "study_id", "idempotency_key", unique=True),)

    study_id: Mapped[str] = mapped_column(
        ForeignKey("studies.id", ondelete="CASCADE"), primary_key=True
    )
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """1, 2, 3, … within the study, without gaps."""
    kind: Mapped[str] = mapped_column(String(32))
    """Endpoint of the request: `optimize` or `evaluate`."""
    created: Mapped[datetime] = mapped_column(Instant)
    request: Mapped[dict[str, Any]] = mapped_column(JSON)
    answer_id: Mapped[str] = mapped_column(ForeignKey("answers.id"), unique=True)
    duration: Mapped[float]
    electrical: Mapped[float]
    mechanical: Mapped[float]
    best: Mapped[int]
    """Number of the iteration of least energy up to this one, the first of equals."""
    met_by: Mapped[int | None]
    """Number of the first iteration up to this one with an energy of at most the threshold."""
    idempotency_key: Mapped[str | None] = mapped_column(String(LENGTHS.key))


class Job(Owned):
    """Requests computed one by one without a waiting client.

    `state` is `waiting`, `running`, `done` (every request has ended), `cancelling` or `cancelled`.
    """

    __tablename__ = "jobs"
    __table_args__ = (Index(None, "created", "id"), Index(None, "ended"))

    name: Mapped[str | None] = mapped_column(String(LENGTHS.name))
    state: Mapped[str] = mapped_column(String(16))
    keep_going: Mapped[bool]
    """Whether the other requests go on after one has failed."""
    started: Mapped[datetime | None] = mapped_column(Instant)
    ended: Mapped[datetime | None] = mapped_column(Instant)
    total: Mapped[int]
    """Number of requests."""
    ended_before: Mapped[int]
    """Number of ended requests at the latest start."""
    events: Mapped[int]
    """Number of its last event."""
    progressed: Mapped[datetime | None] = mapped_column(Instant)
    """Time of its last event `progress`."""
    idempotency_key: Mapped[str | None] = mapped_column(String(LENGTHS.key), unique=True)
    fingerprint: Mapped[str] = mapped_column(String(64))
    """SHA-256 of the requests."""


class JobRequest(Table):
    """One request of a job. `state` is `waiting`, `running`, `done`, `failed` or `cancelled`."""

    __tablename__ = "job_requests"
    # Of an owner, requests with low numbers first: a new job precedes the rest of a long one.
    __table_args__ = (
        Index(None, "state", "owner", "number", "job_id"),
        Index(None, "job_id", "state"),
    )

    job_id: Mapped[str] = mapped_column(ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """Index in the job, from 0."""
    owner: Mapped[str | None] = mapped_column(String(LENGTHS.owner))
    """Owner of the job; owners take turns."""
    name: Mapped[str | None] = mapped_column(String(LENGTHS.name))
    kind: Mapped[str] = mapped_column(String(32))
    """Endpoint of the request."""
    deadline: Mapped[float]
    """Time [s] from the begin of the work."""
    body: Mapped[bytes] = mapped_column(LargeBinary)
    """The request: JSON, compressed."""
    meaning: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    """See `cache.Meaning`; null if stored answers must not be used."""
    state: Mapped[str] = mapped_column(String(16))
    attempt: Mapped[int]
    """Number of leases without preemptions."""
    deaths: Mapped[int]
    """How many workers died of it."""
    preempted: Mapped[int]
    """How often another request took its worker."""
    leased_by: Mapped[str | None] = mapped_column(String(LENGTHS.holder))
    leased_until: Mapped[datetime | None] = mapped_column(Instant)
    wall_time: Mapped[float | None]
    energy: Mapped[float | None]
    duration: Mapped[float | None]
    status: Mapped[str | None] = mapped_column(String(16))
    answer_id: Mapped[str | None] = mapped_column(ForeignKey("answers.id"), unique=True)
    problem: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    figures: Mapped[str | None] = mapped_column(String(LENGTHS.id))
    """Id of identified figures, if they were stored; they may have been deleted since."""


class JobEvent(Table):
    """An event of a job with its number 1, 2, 3, … without gaps."""

    __tablename__ = "job_events"

    job_id: Mapped[str] = mapped_column(ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str] = mapped_column(String(16))
    data: Mapped[dict[str, Any]] = mapped_column(JSON)
