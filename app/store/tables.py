"""The tables, as SQLAlchemy maps them. `migrations/` creates them; a test compares the two."""

from __future__ import annotations

import re
import uuid
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import JSON, DateTime, Dialect, ForeignKey, Index, LargeBinary, MetaData, String, TypeDecorator
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from app.schemas.lengths import ID_LENGTH, KEY_LENGTH, NAME_LENGTH, OWNER_LENGTH, ROBOT_LENGTH

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
    """A unique id for a row."""
    return str(uuid.uuid4())


def is_id(text: str) -> bool:
    """Whether `text` has the form of an id. PostgreSQL rejects some other texts with an error."""
    return re.fullmatch(r"[0-9a-f-]{36}", text) is not None


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
    """Base of the tables. A column `owner` has the name of the API key that created the row; null without one."""

    metadata = MetaData(naming_convention=_NAMES)


class Study(Table):
    """A motion that is improved step by step until its energy is at most `threshold` [J]."""

    __tablename__ = "studies"
    __table_args__ = (Index(None, "created", "id"),)

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    name: Mapped[str] = mapped_column(String(NAME_LENGTH))
    robot: Mapped[str] = mapped_column(String(ROBOT_LENGTH))
    objective: Mapped[str] = mapped_column(String(32))
    threshold: Mapped[float]
    created: Mapped[datetime] = mapped_column(Instant)
    owner: Mapped[str | None] = mapped_column(String(OWNER_LENGTH))
    idempotency_key: Mapped[str | None] = mapped_column(String(KEY_LENGTH), unique=True)


class OwnRobot(Table):
    """A robot that a user added: its figures, as a bundled robot's file has them, and what was remarked on them."""

    __tablename__ = "robots"

    name: Mapped[str] = mapped_column(String(ROBOT_LENGTH), primary_key=True)
    created: Mapped[datetime] = mapped_column(Instant)
    owner: Mapped[str | None] = mapped_column(String(OWNER_LENGTH))
    figures: Mapped[dict[str, Any]] = mapped_column(JSON)
    warnings: Mapped[list[str]] = mapped_column(JSON)


class Answer(Table):
    """A complete answer of an endpoint: JSON, compressed. An answer of a study is deleted with its study, any other by
    age and total size."""

    __tablename__ = "answers"
    # for the sum of sizes from the newest on, without reading the bodies
    __table_args__ = (Index(None, "created", "size"), Index(None, "study_id"))

    id: Mapped[str] = mapped_column(String(ID_LENGTH), primary_key=True)
    kind: Mapped[str] = mapped_column(String(32))
    created: Mapped[datetime] = mapped_column(Instant)
    owner: Mapped[str | None] = mapped_column(String(OWNER_LENGTH))
    study_id: Mapped[str | None] = mapped_column(ForeignKey("studies.id", ondelete="CASCADE"))
    size: Mapped[int]
    """Size of the compressed body [byte]."""
    body: Mapped[bytes] = mapped_column(LargeBinary)


class Iteration(Table):
    """One step of a study: the request and the energies [J] of its motion. The complete answer is in `answers`."""

    __tablename__ = "iterations"
    __table_args__ = (Index(None, "study_id", "idempotency_key", unique=True),)

    study_id: Mapped[str] = mapped_column(ForeignKey("studies.id", ondelete="CASCADE"), primary_key=True)
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
    idempotency_key: Mapped[str | None] = mapped_column(String(KEY_LENGTH))
