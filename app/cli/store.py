"""The database of the service, for commands about added robots."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from joulepath.app.engine.result import TaskResult
    from joulepath.app.engine.task import Task
    from joulepath.app.store.store import Store
    from joulepath.models.robot import Robot

T = TypeVar("T")


def run_with_store(task: Task, deadline: float) -> TaskResult:
    """The result of a task with its log, robot, figures and answers from the database.

    Raises the error of the task; StoreUnavailable if the database is needed.
    """
    from joulepath.app.exceptions.stored import PartsNeeded, UnknownFigures, UnknownLog
    from joulepath.app.tasks.arm_engine import Equipped, Needs
    from joulepath.optimizer.exceptions import UnknownRobot

    needs, equipped = Needs(), task
    while True:
        try:
            return equipped.run(deadline)
        except (UnknownRobot, UnknownFigures, UnknownLog, PartsNeeded) as error:
            needs = needs.after(error)
        equipped = Equipped(task, in_store(needs.given))


def robot_named(name: str) -> Robot:
    """The bundled or added robot of this name.

    Raises UnknownRobot; StoreUnavailable if the database is needed.
    """
    from joulepath.app.tasks.arm_engine import robot_in
    from joulepath.models.registry import load_robot, robot_names

    return (
        load_robot(name) if name in robot_names() else in_store(lambda store: robot_in(store, name))
    )


def in_store(work: Callable[[Store], Any]) -> Any:
    """The result of a coroutine on the database, or its error; UsageError for wrong settings."""
    from joulepath.app.settings import WrongSettings, read_settings
    from joulepath.app.store.store import Store

    try:
        url = read_settings().database_url
    except WrongSettings as error:
        raise click.UsageError(str(error)) from None

    async def run() -> Any:
        store = Store(url)
        try:
            return await work(store)
        finally:
            await store.close()

    return asyncio.run(run())
