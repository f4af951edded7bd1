"""The engine for requests naming a robot: users' own robots accompany the task."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

from joulepath.app.api.report.request import MOST_ROWS
from joulepath.app.convert.recorded import GivenLog, log_given
from joulepath.app.convert.robots import Identified, identified_as, own_robot_named, own_robot_of
from joulepath.app.engine.listening import Listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.app.exceptions.stored import PartsNeeded, UnknownFigures, UnknownLog
from joulepath.app.store import answers, figures, logs, robots
from joulepath.app.store.store import Store
from joulepath.app.tasks.job_document import JOBS, job_document
from joulepath.app.tasks.kept_answers import answers_given
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


Given = Callable[[], AbstractContextManager[None]]
"""Function opening a context with access to one item of the database by name."""


@dataclass(frozen=True)
class Equipped:
    """A task with its items of the database."""

    task: Task
    given: tuple[Given, ...]

    @property
    def request_id(self) -> str:
        """Id of the request."""
        return self.task.request_id

    def run(self, deadline: float) -> TaskResult:
        """The task's result."""
        with _within(self.given):
            return self.task.run(deadline)


@dataclass(frozen=True)
class Needs:
    """Items of the database used by a task.

    A robot by its name, figures and a log by their ids, kept answers by their ids or paths, jobs by
    their paths.
    """

    robot: str | None = None
    figures: str | None = None
    log: str | None = None
    answers: tuple[str, ...] = ()

    def after(self, error: UnknownRobot | UnknownFigures | UnknownLog | PartsNeeded) -> Needs:
        """Adds the item missing in a worker. Raises the error if the item was provided already."""
        if isinstance(error, UnknownRobot):
            more = replace(self, robot=error.name)
        elif isinstance(error, UnknownFigures):
            more = replace(self, figures=error.id)
        elif isinstance(error, UnknownLog):
            more = replace(self, log=error.id)
        else:
            more = replace(self, answers=tuple(dict.fromkeys((*self.answers, *error.names))))
        if more == self:
            raise error
        return more

    async def given(self, store: Store) -> tuple[Given, ...]:
        """The items, read from the database. Raises UnknownRobot, UnknownFigures, UnknownLog,
        UnknownAnswer or StoreUnavailable."""
        found: list[Given] = []
        if self.log is not None:
            found.append(partial(log_given, await given_log(store, self.log)))
        if self.figures is not None:
            found.append(partial(identified_as, await identified(store, self.figures)))
        if self.robot is not None and self.robot not in robot_names():
            found.append(partial(own_robot_named, self.robot, await own_figures(store, self.robot)))
        if self.answers:
            kept = {name: await _kept(store, name) for name in self.answers}
            found.append(partial(answers_given, kept))
        return tuple(found)


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
        needs = Needs(getattr(request, "robot", None), getattr(request, "figures", None))
        while True:
            given = await needs.given(self.store)
            try:
                equipped = Equipped(task, given) if given else task
                return await self.run_one(equipped, deadline, tell=tell)
            # only the worker reads the body of an upload, or a kept answer, and the names in it
            except (UnknownRobot, UnknownFigures, UnknownLog, PartsNeeded) as error:
                needs = needs.after(error)


async def robot_in(store: Store, name: str) -> Robot:
    """The bundled or added robot of this name.

    Raises UnknownRobot; StoreUnavailable only for added robots.
    """
    return (
        load_robot(name)
        if name in robot_names()
        else own_robot_of(name, await own_figures(store, name))
    )


async def known_here(store: Store, name: str, used: str | None) -> AbstractContextManager[Any]:
    """A context in which this process knows an added robot and identified figures.

    Raises UnknownRobot, UnknownFigures or StoreUnavailable.
    """
    return _within(await Needs(name, used).given(store))


def _within(given: tuple[Given, ...]) -> AbstractContextManager[Any]:
    context = ExitStack()
    for each in given:
        context.enter_context(each())
    return context


async def identified(store: Store, id: str) -> Identified:
    """The identified figures of this id. Raises UnknownFigures or StoreUnavailable."""
    row = await store.read(partial(figures.get, id=id))
    return Identified(row.id, row.robot, row.content)


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
