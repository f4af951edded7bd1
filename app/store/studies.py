"""Studies and their iterations. All functions take a session."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import delete as delete_from
from sqlalchemy import select
from sqlalchemy.orm import Session, defer

from joulepath.app.access.client import Client
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.exceptions.stored import KeyReused, UnknownIteration, UnknownStudy
from joulepath.app.store import answers, cache
from joulepath.app.store.cache import Answered
from joulepath.app.store.paging import having, page_of
from joulepath.app.store.shares import stored_key
from joulepath.app.store.tables import Iteration, Study, by_id, new_id, now

_LIGHT = defer(Iteration.request, raiseload=True)
"""Leaves out the request of an iteration."""


@dataclass(frozen=True)
class Step:
    """An iteration to add: a `request` to the endpoint `kind`, its `answer`, duration [s] and
    energies [J].
    """

    kind: str
    request: dict[str, Any]
    answer: StoredAnswer
    duration: float
    electrical: float
    mechanical: float
    answered: Answered | None = None
    """The request answered by a newly computed answer."""


@dataclass(frozen=True)
class Entry:
    """An iteration, the previous one, and the best iterations up to both.

    Only `entry` loads a request, the one of `iteration`.
    """

    study: Study
    iteration: Iteration
    before: Iteration | None
    best_before: Iteration | None
    best: Iteration


@dataclass(frozen=True)
class State:
    """A study with its last and its best iteration; both None if it has none. Their requests are
    not loaded.
    """

    study: Study
    last: Iteration | None
    best: Iteration | None


@dataclass(frozen=True)
class History:
    """A study with its iterations in order of their numbers. Their requests are not loaded."""

    state: State
    iterations: list[Iteration]


def energy_of(study: Study, iteration: Iteration | Step) -> float:
    """Energy of an iteration, of the study's objective [J]."""
    return float(getattr(iteration, study.objective))


def create(session: Session, study: Study) -> tuple[Study, bool]:
    """Adds a study; returns it, and whether a study with this key existed already.

    Raises KeyReused if the existing study differs.
    """
    if study.idempotency_key is not None:
        known = session.scalar(select(Study).where(Study.idempotency_key == study.idempotency_key))
        if known is not None:
            if any(
                getattr(known, name) != getattr(study, name)
                for name in ("name", "robot", "figures", "objective", "threshold")
            ):
                raise KeyReused
            return known, True
    session.add(study)
    return study, False


def history(session: Session, study_id: str) -> History:
    """A study with all its iterations. Raises UnknownStudy."""
    query = select(Iteration).where(Iteration.study_id == study_id).order_by(Iteration.number)
    return History(state(session, study_id), list(session.scalars(query.options(_LIGHT))))


def state(session: Session, study_id: str) -> State:
    """A study with its last and its best iteration. Raises UnknownStudy."""
    return _state(session, _study(session, study_id))


def page(
    session: Session, limit: int, after: str | None, search: str | None
) -> tuple[list[State], str | None]:
    """Up to `limit` studies, newest first, and the `after` of the next page; None on the last
    page. With a `search`, those that have this text in their name or robot."""
    query = select(Study).where(having(search, Study.name, Study.robot))
    studies, following = page_of(session, query, Study, limit, after)
    return [_state(session, study) for study in studies], following


def rename(session: Session, study_id: str, name: str, client: Client) -> State:
    """Gives a study another name. Raises UnknownStudy or NotOwner."""
    study = _study(session, study_id, client)
    study.name = name
    return _state(session, study)


def delete(session: Session, study_id: str, client: Client) -> None:
    """Deletes a study, its iterations and their answers. Raises UnknownStudy or NotOwner."""
    study = _study(session, study_id, client)
    session.execute(delete_from(Study).where(Study.id == study.id))


def known_step(
    session: Session, study_id: str, kind: str, request: dict[str, Any], key: str | None
) -> int | None:
    """Number of the iteration with this key; None without one.

    Raises UnknownStudy, or KeyReused if the iteration has another request.
    """
    _study(session, study_id)
    if key is None:
        return None
    known = session.scalar(
        select(Iteration).where(Iteration.study_id == study_id, Iteration.idempotency_key == key)
    )
    if known is None:
        return None
    if (known.kind, known.request) != (kind, request):
        raise KeyReused
    return known.number


def add(
    session: Session, study_id: str, step: Step, key: str | None, client: Client
) -> tuple[int, bool]:
    """Adds an iteration; returns its number, and whether its key existed already.

    Raises UnknownStudy, NotOwner or KeyReused.
    """
    _study(session, study_id, client)
    # Lock the study in PostgreSQL, so that numbers have no gaps; SQLite has only one writer.
    study = session.scalar(select(Study).where(Study.id == study_id).with_for_update())
    if study is None:
        raise UnknownStudy
    known = known_step(session, study_id, step.kind, step.request, key)
    if known is not None:
        return known, True
    answers.put(session, step.kind, step.answer, study_id, owner=client.owner)
    session.flush()
    cache.remember(session, [] if step.answered is None else [step.answered])
    so_far, energy = _state(session, study), energy_of(study, step)
    number = 1 if so_far.last is None else so_far.last.number + 1
    met_by = number if energy <= study.threshold else None
    if so_far.last is not None and so_far.last.met_by is not None:
        met_by = so_far.last.met_by
    best = so_far.best
    session.add(
        Iteration(
            study_id=study_id,
            number=number,
            kind=step.kind,
            created=now(),
            request=step.request,
            answer_id=step.answer.id,
            duration=step.duration,
            electrical=step.electrical,
            mechanical=step.mechanical,
            best=number if best is None or energy < energy_of(study, best) else best.number,
            met_by=met_by,
            idempotency_key=key,
        )
    )
    return number, False


def entry(session: Session, study_id: str, number: int) -> Entry:
    """An iteration with its request and the iterations for comparison.

    Raises UnknownStudy or UnknownIteration.
    """
    study = _study(session, study_id)
    iteration = session.get(Iteration, (study_id, number))
    if iteration is None:
        raise UnknownIteration
    before = _iteration(session, study_id, number - 1) if number > 1 else None
    best_before = None if before is None else _iteration(session, study_id, before.best)
    return Entry(
        study, iteration, before, best_before, _iteration(session, study_id, iteration.best)
    )


def new_study(
    name: str,
    robot: str,
    objective: str,
    threshold: float,
    key: str | None,
    owner: str | None,
    figures: str | None = None,
) -> Study:
    """A new study, not yet in the database."""
    return Study(
        id=new_id(),
        name=name,
        robot=robot,
        figures=figures,
        objective=objective,
        threshold=threshold,
        created=now(),
        owner=owner,
        idempotency_key=None if key is None else stored_key(key, owner),
    )


def _study(session: Session, study_id: str, client: Client | None = None) -> Study:
    return by_id(session, Study, study_id, UnknownStudy, client)


def _state(session: Session, study: Study) -> State:
    query = (
        select(Iteration)
        .where(Iteration.study_id == study.id)
        .order_by(Iteration.number.desc())
        .limit(1)
    )
    last = session.scalar(query.options(_LIGHT))
    return State(study, last, None if last is None else _iteration(session, study.id, last.best))


def _iteration(session: Session, study_id: str, number: int) -> Iteration:
    return session.get_one(Iteration, (study_id, number), options=[_LIGHT])
