"""The engine for requests that name a robot: users' own robots come from the database, and go along with the task."""

from __future__ import annotations

from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from joulepath.app.convert.identified import Identified, identified_as
from joulepath.app.convert.own_robots import own_robot_named, own_robot_of
from joulepath.app.convert.recorded import GivenLog, log_given
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.app.exceptions.stored import UnknownFigures, UnknownLog
from joulepath.app.store import figures, logs, robots
from joulepath.app.store.store import Store
from joulepath.models.registry import load_robot, robot_names
from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import UnknownRobot
from joulepath.optimizer.progress import Tell, nobody


class Runner(Protocol):
    """What runs a task: the engine, or a process that runs its tasks itself."""

    async def run(self, task: Task, deadline: float, tell: Tell = nobody) -> TaskResult:
        """The result of a task, for which `deadline` [s] is left. `tell` gets what it finds."""
        ...


@dataclass(frozen=True)
class WithOwnRobot:
    """A task, and the name and figures of the own robot that it is about."""

    task: Task
    name: str
    figures: dict[str, Any]

    @property
    def request_id(self) -> str:
        """Id of the request."""
        return self.task.request_id

    def run(self, deadline: float) -> TaskResult:
        """The task's result."""
        with own_robot_named(self.name, self.figures):
            return self.task.run(deadline)


@dataclass(frozen=True)
class WithFigures:
    """A task, and the identified figures that it names."""

    task: Task
    figures: Identified

    @property
    def request_id(self) -> str:
        """Id of the request."""
        return self.task.request_id

    def run(self, deadline: float) -> TaskResult:
        """The task's result."""
        with identified_as(self.figures):
            return self.task.run(deadline)


@dataclass(frozen=True)
class WithLog:
    """A task, and the stored log that it names."""

    task: Task
    log: GivenLog

    @property
    def request_id(self) -> str:
        """Id of the request."""
        return self.task.request_id

    def run(self, deadline: float) -> TaskResult:
        """The task's result."""
        with log_given(self.log):
            return self.task.run(deadline)


@dataclass(frozen=True)
class ArmEngine:
    """Runs tasks about robots that come with the service and about those in the database, with their own figures or
    with identified ones."""

    engine: Runner
    store: Store

    async def run(self, task: Task, deadline: float, tell: Tell = nobody) -> TaskResult:
        """The task's result; `tell` gets what it finds.

        Raises UnknownRobot, UnknownFigures, UnknownLog, and what the engine raises; StoreUnavailable only for figures,
        a log, and a robot that does not come with the service.
        """
        log: str | None = None
        request = getattr(task, "request", None)
        name, used = getattr(request, "robot", None), getattr(request, "figures", None)
        while True:
            equipped = await self._equipped(task, name, used, log)
            try:
                return await self.engine.run(equipped, deadline, tell)
            # only the worker reads the body of an upload, and the names in it
            except UnknownRobot as error:
                if error.name == name:
                    raise
                name = error.name
            except UnknownFigures as error:
                if error.id == used:
                    raise
                used = error.id
            except UnknownLog as error:
                if error.id == log:
                    raise
                log = error.id

    async def _equipped(self, task: Task, name: str | None, used: str | None, log: str | None) -> Task:
        """The task with what it needs of the database.

        Raises UnknownRobot, UnknownFigures, UnknownLog or StoreUnavailable.
        """
        if log is not None:
            task = WithLog(task, await given_log(self.store, log))
        if used is not None:
            task = WithFigures(task, await identified(self.store, used))
        if name is not None and name not in robot_names():
            task = WithOwnRobot(task, name, await own_figures(self.store, name))
        return task


async def robot_in(store: Store, name: str) -> Robot:
    """The robot of this name, one that comes with the service or one in the database.

    Raises UnknownRobot; StoreUnavailable only for a robot that does not come with the service.
    """
    return load_robot(name) if name in robot_names() else own_robot_of(name, await own_figures(store, name))


async def known_here(store: Store, name: str, used: str | None) -> AbstractContextManager[Any]:
    """A context in which this process knows the robot of this name, too, and the figures of this id.

    Raises UnknownRobot, UnknownFigures or StoreUnavailable.
    """
    context = ExitStack()
    if name not in robot_names():
        context.enter_context(own_robot_named(name, await own_figures(store, name)))
    if used is not None:
        context.enter_context(identified_as(await identified(store, used)))
    return context


async def identified(store: Store, id: str) -> Identified:
    """The identified figures of this id. Raises UnknownFigures or StoreUnavailable."""
    row = await store.read(partial(figures.get, id=id))
    return Identified(row.id, row.robot, row.content)


async def given_log(store: Store, id: str) -> GivenLog:
    """The stored log of this id. Raises UnknownLog or StoreUnavailable."""
    row = await store.read(partial(logs.get, log_id=id))
    return GivenLog(id, row.settings, row.body)


async def own_figures(store: Store, name: str) -> dict[str, Any]:
    """Figures of a robot that a user added. Raises UnknownRobot or StoreUnavailable."""
    return (await store.read(partial(robots.get, name=name))).figures
