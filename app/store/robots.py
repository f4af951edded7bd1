"""Robots added by users. All functions take a session."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from joulepath.app.access.client import Client, check_owner
from joulepath.app.exceptions.stored import BundledRobot, RobotExists, TooManyRobots
from joulepath.app.store.shares import COUNT, room_of
from joulepath.app.store.tables import OwnRobot
from joulepath.models.registry import robot_names
from joulepath.optimizer.exceptions import UnknownRobot


def check_own(name: str) -> None:
    """Raises BundledRobot for a robot of the service, which cannot be changed."""
    if name in robot_names():
        raise BundledRobot


def all_of(session: Session) -> list[OwnRobot]:
    """All added robots, by name."""
    return list(session.scalars(select(OwnRobot).order_by(OwnRobot.name)))


def get(session: Session, name: str) -> OwnRobot:
    """The robot of this name. Raises UnknownRobot with the names of all robots."""
    found = session.get(OwnRobot, name)
    if found is None:
        raise UnknownRobot(name, [*robot_names(), *_own_names(session)])
    return found


def _own_names(session: Session) -> list[str]:
    return list(session.scalars(select(OwnRobot.name).order_by(OwnRobot.name)))


def add(session: Session, robot: OwnRobot, most: int) -> None:
    """Adds a robot. Raises RobotExists, or TooManyRobots above the owner's share of `most`."""
    if session.get(OwnRobot, robot.name) is not None:
        raise RobotExists
    _check_count(session, most, robot.owner)
    session.add(robot)


def put(session: Session, robot: OwnRobot, most: int, client: Client) -> bool:
    """Adds a robot, or replaces it under its owner; returns whether it is new.

    Raises NotOwner, or TooManyRobots above the owner's share of `most`.
    """
    known = session.get(OwnRobot, robot.name)
    if known is not None:
        check_owner(client, known.owner)
        robot.owner = known.owner
        known.created, known.figures, known.warnings = robot.created, robot.figures, robot.warnings
        return False
    _check_count(session, most, robot.owner)
    session.add(robot)
    return True


def rename(session: Session, name: str, title: str | None, client: Client) -> OwnRobot:
    """Gives a robot another title; None for its name. Raises the errors of `delete`."""
    robot = _of_client(session, name, client)
    robot.figures = robot.figures | {"title": title or name}
    return robot


def delete(session: Session, name: str, client: Client) -> None:
    """Deletes a robot.

    Raises:
        BundledRobot: the robot comes with the service.
        UnknownRobot: there is no such robot; the error has the names of added robots.
        NotOwner: the robot belongs to another client.
    """
    session.delete(_of_client(session, name, client))


def _of_client(session: Session, name: str, client: Client) -> OwnRobot:
    check_own(name)
    robot = session.get(OwnRobot, name)
    if robot is None:
        raise UnknownRobot(name, _own_names(session))
    check_owner(client, robot.owner)
    return robot


def _check_count(session: Session, most: int, owner: str | None) -> None:
    if room_of(session, owner, most, OwnRobot.owner, COUNT)[0] < 1:
        raise TooManyRobots
