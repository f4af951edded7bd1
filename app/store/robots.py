"""Robots that users added. Each function works on a session: `await store.write(partial(put, …))`."""

from __future__ import annotations

from sqlalchemy import delete as delete_from
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.exceptions import RobotExists, TooManyRobots
from app.store.tables import OwnRobot


def names(session: Session) -> list[str]:
    """Names of all robots that users added."""
    return list(session.scalars(select(OwnRobot.name).order_by(OwnRobot.name)))


def all_of(session: Session) -> list[OwnRobot]:
    """All robots that users added, by name."""
    return list(session.scalars(select(OwnRobot).order_by(OwnRobot.name)))


def get(session: Session, name: str) -> OwnRobot | None:
    """The robot of this name; None if there is none."""
    return session.get(OwnRobot, name)


def add(session: Session, robot: OwnRobot, most: int) -> None:
    """Adds a robot. Raises RobotExists, or TooManyRobots if there are `most` of them."""
    if session.get(OwnRobot, robot.name) is not None:
        raise RobotExists
    _check_count(session, most)
    session.add(robot)


def put(session: Session, robot: OwnRobot, most: int) -> bool:
    """Adds or replaces a robot; whether it is new. Raises TooManyRobots if it is one more than `most`."""
    known = session.get(OwnRobot, robot.name)
    if known is not None:
        known.created, known.figures, known.warnings = robot.created, robot.figures, robot.warnings
        return False
    _check_count(session, most)
    session.add(robot)
    return True


def delete(session: Session, name: str) -> bool:
    """Deletes a robot; whether there was one."""
    found = session.execute(delete_from(OwnRobot).where(OwnRobot.name == name).returning(OwnRobot.name))
    return found.first() is not None


def _check_count(session: Session, most: int) -> None:
    if (session.scalar(select(func.count()).select_from(OwnRobot)) or 0) >= most:
        raise TooManyRobots
