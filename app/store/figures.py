"""Figures identified on one arm. All functions take a session."""

from __future__ import annotations

import json
import uuid
from functools import partial
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from joulepath.app.access.client import Client
from joulepath.app.exceptions.stored import FiguresInUse, TooManyFigures, UnknownFigures
from joulepath.app.store.shares import COUNT, room_of
from joulepath.app.store.tables import Figures, Study, by_id, now

_SPACE = uuid.UUID("6d0c5a0e-7b0e-5d5f-9a53-1d1f5b1c4a9e")


def new_figures(robot: str, content: dict[str, Any], owner: str | None) -> Figures:
    """Figures replacing the robot's own, not yet in the database.

    `content` is the result of `joulepath.models.uncertainty.document.replaced_in`.
    """
    text = json.dumps([robot, content], sort_keys=True)
    return Figures(
        id=str(uuid.uuid5(_SPACE, text)), robot=robot, created=now(), owner=owner, content=content
    )


def put(session: Session, figures: Figures, most: int) -> tuple[Figures, bool]:
    """Adds figures; returns the figures of this id, and whether they are new.

    Raises TooManyFigures above the owner's share of `most`.
    """
    known = session.get(Figures, figures.id)
    if known is not None:
        return known, False
    if room_of(session, figures.owner, most, Figures.owner, COUNT)[0] < 1:
        raise TooManyFigures
    session.add(figures)
    return figures, True


def all_of(session: Session) -> list[Figures]:
    """All figures, newest first."""
    return list(session.scalars(select(Figures).order_by(Figures.created.desc(), Figures.id)))


def get(session: Session, id: str) -> Figures:
    """The figures of this id. Raises UnknownFigures."""
    return by_id(session, Figures, id, partial(UnknownFigures, id))


def delete(session: Session, id: str, client: Client) -> None:
    """Deletes figures. Raises UnknownFigures, NotOwner, or FiguresInUse by a study."""
    figures = by_id(session, Figures, id, partial(UnknownFigures, id), client)
    if session.scalar(select(Study.id).where(Study.figures == id).limit(1)) is not None:
        raise FiguresInUse
    session.delete(figures)
