"""The engine for requests that name a robot: users' own robots come from the database, and go along with the task."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from app.convert.own_robots import own_robot_named
from app.engine.result import TaskResult
from app.engine.task import Task
from app.store import robots
from app.store.store import Store
from models.own_arm.robots import own_robot
from models.registry import load_robot, robot_names
from models.robot import Robot
from optimizer.exceptions import UnknownRobot
from optimizer.progress import Tell, nobody


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
class ArmEngine:
    """Runs tasks about robots that come with the service and about those in the database."""

    engine: Runner
    store: Store

    async def run(self, task: Task, deadline: float, tell: Tell = nobody) -> TaskResult:
        """The task's result; `tell` gets what it finds.

        Raises UnknownRobot, and what the engine raises; StoreUnavailable only for a robot that does not come with the
        service.
        """
        name = getattr(getattr(task, "request", None), "robot", None)
        if name is None or name in robot_names():
            try:
                return await self.engine.run(task, deadline, tell)
            except UnknownRobot as error:
                # only the worker reads the body of an upload, and the name in it
                name = error.name
        return await self.engine.run(WithOwnRobot(task, name, await own_figures(self.store, name)), deadline, tell)


async def robot_in(store: Store, name: str) -> Robot:
    """The robot of this name, one that comes with the service or one in the database.

    Raises UnknownRobot; StoreUnavailable only for a robot that does not come with the service.
    """
    return load_robot(name) if name in robot_names() else own_robot(name, await own_figures(store, name))


async def known_here(store: Store, name: str) -> AbstractContextManager[None]:
    """A context in which this process knows the robot of this name, too. Raises UnknownRobot or StoreUnavailable."""
    return nullcontext() if name in robot_names() else own_robot_named(name, await own_figures(store, name))


async def own_figures(store: Store, name: str) -> dict[str, Any]:
    """Figures of a robot that a user added. Raises UnknownRobot or StoreUnavailable."""
    return (await store.read(partial(robots.get, name=name))).figures
