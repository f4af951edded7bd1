"""Studies and their iterations. Each function works on a session: `await store.write(partial(create, …))`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy import and_, or_, select
from sqlalchemy import delete as delete_from
from sqlalchemy.orm import Session, defer

from app.access.client import Client
from app.access.rules import check_owner
from app.exceptions import KeyReused, UnknownIteration, UnknownStudy
from app.store import answers
from app.store.tables import Iteration, Study, is_id, new_id, now

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)


@dataclass(frozen=True)
class Step:
    """An iteration to add: a `request` to the endpoint `kind`, its `answer`, duration [s] and energies [J]."""

    kind: str
    request: dict[str, Any]
    answer: bytes
    duration: float
    electrical: float
    mechanical: float


@dataclass(frozen=True)
class History:
    """A study and its iterations in order of their numbers. Their requests are loaded for one iteration only."""

    study: Study
    iterations: list[Iteration]

    @property
    def energies(self) -> list[float]:
        """Energy of each iteration, of the study's objective [J]."""
        return [getattr(iteration, self.study.objective) for iteration in self.iterations]


def create(session: Session, study: Study) -> tuple[Study, bool]:
    """Adds a study and returns it with False; if its key is known, the study of that key with True.

    Raises KeyReused if that study differs.
    """
    if study.idempotency_key is not None:
        known = session.scalar(select(Study).where(Study.idempotency_key == study.idempotency_key))
        if known is not None:
            if any(
                getattr(known, name) != getattr(study, name)
                for name in ("name", "robot", "objective", "threshold", "owner")
            ):
                raise KeyReused
            return known, True
    session.add(study)
    return study, False


def history(session: Session, study_id: str) -> History:
    """A study with all its iterations. Raises UnknownStudy."""
    return History(_study(session, study_id), _iterations(session, [study_id]))


def page(session: Session, limit: int, after: str | None) -> tuple[list[History], str | None]:
    """Up to `limit` studies, newest first, and the `after` of the next page; None on the last page."""
    query = select(Study).order_by(Study.created.desc(), Study.id.desc()).limit(limit + 1)
    if after is not None:
        microseconds, study_id = after.split("_")
        created = _EPOCH + int(microseconds) * _MICROSECOND
        query = query.where(or_(Study.created < created, and_(Study.created == created, Study.id < study_id)))
    studies = list(session.scalars(query))
    more, studies = len(studies) > limit, studies[:limit]
    found = _iterations(session, [study.id for study in studies])
    histories = [History(study, [entry for entry in found if entry.study_id == study.id]) for study in studies]
    last = studies[-1] if more else None
    return histories, None if last is None else f"{(last.created - _EPOCH) // _MICROSECOND}_{last.id}"


def delete(session: Session, study_id: str, client: Client) -> None:
    """Deletes a study, its iterations and their answers. Raises UnknownStudy or NotOwner."""
    study = _study(session, study_id)
    check_owner(client, study.owner)
    session.execute(delete_from(Study).where(Study.id == study.id))


def known_step(session: Session, study_id: str, kind: str, request: dict[str, Any], key: str | None) -> int | None:
    """Number of the iteration with this key; None if there is none.

    Raises UnknownStudy, or KeyReused if that iteration has another request.
    """
    _study(session, study_id)
    if key is None:
        return None
    known = session.scalar(select(Iteration).where(Iteration.study_id == study_id, Iteration.idempotency_key == key))
    if known is None:
        return None
    if (known.kind, known.request) != (kind, request):
        raise KeyReused
    return known.number


def add(session: Session, study_id: str, step: Step, key: str | None, client: Client) -> tuple[int, bool]:
    """Adds an iteration and returns its number with False; if its key is known, the number of that key with True.

    Raises UnknownStudy, NotOwner or KeyReused.
    """
    check_owner(client, _study(session, study_id).owner)
    # locks the study (PostgreSQL), so that numbers have no gaps; SQLite has one writer at a time anyway
    if session.scalar(select(Study.id).where(Study.id == study_id).with_for_update()) is None:
        raise UnknownStudy
    known = known_step(session, study_id, step.kind, step.request, key)
    if known is not None:
        return known, True
    last = session.scalar(
        select(Iteration.number).where(Iteration.study_id == study_id).order_by(Iteration.number.desc()).limit(1)
    )
    answer_id = answers.put(session, step.kind, step.answer, study_id, owner=client.owner)
    session.flush()
    number = (last or 0) + 1
    session.add(
        Iteration(
            study_id=study_id,
            number=number,
            kind=step.kind,
            created=now(),
            request=step.request,
            answer_id=answer_id,
            duration=step.duration,
            electrical=step.electrical,
            mechanical=step.mechanical,
            idempotency_key=key,
        )
    )
    return number, False


def up_to(session: Session, study_id: str, number: int) -> History:
    """A study with its iterations up to `number`; the last one has its request.

    Raises UnknownStudy or UnknownIteration.
    """
    study = _study(session, study_id)
    last = session.get(Iteration, (study_id, number))
    if last is None:
        raise UnknownIteration
    return History(study, [entry for entry in _iterations(session, [study_id]) if entry.number <= number])


def new_study(name: str, robot: str, objective: str, threshold: float, key: str | None, owner: str | None) -> Study:
    """A new study, not yet in the database."""
    return Study(
        id=new_id(),
        name=name,
        robot=robot,
        objective=objective,
        threshold=threshold,
        created=now(),
        owner=owner,
        idempotency_key=key,
    )


def _study(session: Session, study_id: str) -> Study:
    study = session.get(Study, study_id) if is_id(study_id) else None
    if study is None:
        raise UnknownStudy
    return study


def _iterations(session: Session, study_ids: Sequence[str]) -> list[Iteration]:
    query = select(Iteration).where(Iteration.study_id.in_(study_ids)).order_by(Iteration.study_id, Iteration.number)
    return list(session.scalars(query.options(defer(Iteration.request, raiseload=True))))
