"""The database of the service, for commands that name a robot which a user added."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from joulepath.app.engine.task import Task
    from joulepath.app.store.store import Store
    from joulepath.models.robot import Robot

T = TypeVar("T")


def with_own_robot(task: Task, name: str) -> Task:
    """The task, with the robot that a user added. Raises UnknownRobot or StoreUnavailable."""
    from joulepath.app.tasks.arm_engine import WithOwnRobot, own_figures

    return WithOwnRobot(task, name, in_store(lambda store: own_figures(store, name)))


def with_figures(task: Task, id: str) -> Task:
    """The task, with identified figures. Raises UnknownFigures or StoreUnavailable."""
    from joulepath.app.tasks.arm_engine import WithFigures, identified

    return WithFigures(task, in_store(lambda store: identified(store, id)))


def with_log(task: Task, id: str) -> Task:
    """The task, with a stored log. Raises UnknownLog or StoreUnavailable."""
    from joulepath.app.tasks.arm_engine import WithLog, given_log

    return WithLog(task, in_store(lambda store: given_log(store, id)))


def robot_named(name: str) -> Robot:
    """The robot of this name: one that comes with the library, or one in the database.

    Raises UnknownRobot; StoreUnavailable if the database is needed.
    """
    from joulepath.app.tasks.arm_engine import robot_in
    from joulepath.models.registry import load_robot, robot_names

    return load_robot(name) if name in robot_names() else in_store(lambda store: robot_in(store, name))


def in_store(work: Callable[[Store], Any]) -> Any:
    """What a coroutine on the database returns. Raises what it raises."""
    from joulepath.app.settings import Settings
    from joulepath.app.store.store import Store

    async def run() -> Any:
        store = Store(Settings().database_url)
        try:
            return await work(store)
        finally:
            await store.close()

    return asyncio.run(run())
