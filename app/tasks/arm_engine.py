"""The engine for requests naming a robot: users' own robots accompany the task."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from joulepath.app.api.report.request import MOST_ROWS
from joulepath.app.convert.items import Items, Key, given
from joulepath.app.convert.recorded import GivenLog
from joulepath.app.convert.robots import Identified, own_robot_of
from joulepath.app.engine.listening import Listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.app.exceptions.stored import PartsNeeded, UnknownFigures, UnknownLog
from joulepath.app.store import answers, figures, logs, robots
from joulepath.app.store.store import Store
from joulepath.app.tasks.job_document import JOBS, job_document
from joulepath.models.registry import robot_names
from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import UnknownRobot
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.progress import no_listener


class Run(Protocol):
    """A function for the result of a task in at most `deadline` [s]; `tell` receives its events."""

    async def __call__(self, task: Task, deadline: float, *, tell: Listener) -> TaskResult:
        """The result of the task."""
        ...


@dataclass(frozen=True)
class Equipped:
    """A task with its items of the database."""

    task: Task
    items: Items

    @property
    def request_id(self) -> str:
        """Id of the request."""
        return self.task.request_id

    def run(self, deadline: float) -> TaskResult:
        """The task's result."""
        with given(self.items):
            return self.task.run(deadline)


MISSING = (UnknownRobot, UnknownFigures, UnknownLog, PartsNeeded)
"""Errors of a task without an item of the database."""


def missing(
    error: UnknownRobot | UnknownFigures | UnknownLog | PartsNeeded, items: Items
) -> list[Key]:
    """The items missing in a task. Raises the error if the task has them."""
    keys: list[Key]
    if isinstance(error, UnknownRobot):
        keys = [("robot", error.name)]
    elif isinstance(error, UnknownFigures):
        keys = [("figures", error.id)]
    elif isinstance(error, UnknownLog):
        keys = [("log", error.id)]
    else:
        keys = [("answer", name) for name in error.names]
    new = [key for key in keys if key not in items]
    if not new:
        raise error
    return new


@dataclass(frozen=True)
class ArmEngine:
    """Runs tasks about bundled or added robots, with their own or identified figures."""

    run_one: Run
    store: Store

    async def run(self, task: Task, deadline: float, tell: Listener = no_listener) -> TaskResult:
        """The task's result; `tell` receives its events.

        Raises UnknownRobot, UnknownFigures, UnknownLog, UnknownAnswer, and the errors of the
        engine; StoreUnavailable only for items of the database.
        """
        request = getattr(task, "request", None)
        keys = _keys(getattr(request, "robot", None), getattr(request, "figures", None))
        items: dict[Key, Any] = {}
        while True:
            items |= await items_of(self.store, keys)
            try:
                equipped = Equipped(task, items) if items else task
                return await self.run_one(equipped, deadline, tell=tell)
            # only the worker reads the body of an upload, or a kept answer, and the names in it
            except MISSING as error:
                keys = missing(error, items)


async def robot_in(store: Store, name: str) -> Robot:
    """The bundled or added robot of this name.

    Raises UnknownRobot; StoreUnavailable only for added robots.
    """
    return (
        load_robot(name)
        if name in robot_names()
        else own_robot_of(name, await own_figures(store, name))
    )


async def known_here(store: Store, name: str, used: str | None) -> AbstractContextManager[None]:
    """A context in which this process knows an added robot and identified figures.

    Raises UnknownRobot, UnknownFigures or StoreUnavailable.
    """
    return given(await items_of(store, _keys(name, used)))


def _keys(robot: str | None, figures: str | None) -> list[Key]:
    """The added robot and the figures that a request names, if any."""
    keys: list[Key] = [] if figures is None else [("figures", figures)]
    return keys if robot is None or robot in robot_names() else [*keys, ("robot", robot)]


async def _identified(store: Store, id: str) -> Identified:
    """The identified figures of this id. Raises UnknownFigures or StoreUnavailable."""
    row = await store.read(partial(figures.get, id=id))
    return Identified(row.robot, row.content)


async def given_log(store: Store, id: str) -> GivenLog:
    """The stored log of this id. Raises UnknownLog or StoreUnavailable."""
    row = await store.read(partial(logs.get, log_id=id))
    return GivenLog(id, row.settings, row.body)


async def _kept(store: Store, name: str) -> bytes:
    path, _, id = name.rpartition("/")
    if path == JOBS:
        return await store.read(partial(job_document, job_id=id, most=MOST_ROWS))
    _, body = await store.read(partial(answers.get, answer_id=id))
    return body


async def own_figures(store: Store, name: str) -> dict[str, Any]:
    """Figures of an added robot. Raises UnknownRobot or StoreUnavailable."""
    return (await store.read(partial(robots.get, name=name))).figures


_READERS = {"robot": own_figures, "figures": _identified, "log": given_log, "answer": _kept}


async def items_of(store: Store, keys: Iterable[Key]) -> dict[Key, Any]:
    """Items from the database. Raises UnknownRobot, UnknownFigures, UnknownLog, UnknownAnswer or
    StoreUnavailable."""
    return {(kind, name): await _READERS[kind](store, name) for kind, name in keys}
