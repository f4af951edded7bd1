"""The database of the service, for commands about added robots."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from joulepath.app.convert.items import Key
    from joulepath.app.engine.result import TaskResult
    from joulepath.app.engine.task import Task
    from joulepath.app.store.store import Store
    from joulepath.models.robot import Robot


def run_with_store(task: Task, deadline: float, answers: Path | None = None) -> TaskResult:
    """The result of a task with its log, robot, figures and answers from the database.

    Args:
        task: the task.
        deadline: longest wall time [s].
        answers: folder with the answers of a cycle's moves, as ID.json; moves that are missing
            there are read from the database.

    Raises:
        StoreUnavailable: the database is needed.
        DeclaredError: errors of the task.
        click.FileError: the folder cannot be read.
    """
    from joulepath.app.tasks.arm_engine import MISSING, Equipped, items_of, missing

    items = {} if answers is None else _answers_in(answers)
    while True:
        try:
            return Equipped(task, items).run(deadline)
        except MISSING as error:
            keys = missing(error, items)
        items |= in_store(partial(items_of, keys=keys))


def _answers_in(folder: Path) -> dict[Key, Any]:
    """The answers in a folder. Raises click.FileError."""
    from joulepath.app.engine.result import path_of_answer

    try:
        return {
            ("answer", path_of_answer(file.stem)): file.read_bytes()
            for file in folder.glob("*.json")
        }
    except OSError as error:
        raise click.FileError(str(folder), error.strerror or "") from None


def robot_named(name: str) -> Robot:
    """The bundled or added robot of this name.

    Raises UnknownRobot; StoreUnavailable if the database is needed.
    """
    from joulepath.app.tasks.arm_engine import robot_in
    from joulepath.models.registry import robot_names
    from joulepath.optimizer.problem.robots import load_robot

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
