"""Robots that users added. Each function works on a session: `await store.write(partial(put, …))`."""

from __future__ import annotations

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.exceptions import RobotExists, TooManyRobots
from app.store.tables import OwnRobot
from models.registry import robot_names
from optimizer.exceptions import UnknownRobot


def check_own(name: str) -> None:
    """Raises RobotExists for a robot that comes with the service: nobody adds, replaces or deletes it."""
    if name in robot_names():
        raise RobotExists


def all_of(session: Session) -> list[OwnRobot]:
    """All robots that users added, by name."""
    return list(session.scalars(select(OwnRobot).order_by(OwnRobot.name)))


def get(session: Session, name: str) -> OwnRobot:
    """The robot of this name. Raises UnknownRobot, which knows the names of all robots."""
    found = session.get(OwnRobot, name)
    if found is None:
        raise UnknownRobot(name, [*robot_names(), *session.scalars(select(OwnRobot.name).order_by(OwnRobot.name))])
    return found


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


def delete(session: Session, name: str) -> None:
    """Deletes a robot. Raises RobotExists for one that comes with the service, UnknownRobot if there is none."""
    check_own(name)
    session.delete(get(session, name))


def _check_count(session: Session, most: int) -> None:
    if (session.scalar(select(func.count()).select_from(OwnRobot)) or 0) >= most:
        raise TooManyRobots
