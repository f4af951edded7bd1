"""One machine of a cluster: an engine inside a Dask worker, as `dask worker --preload
joulepath.app.cluster` starts it.

Dask carries tasks. It does not compute them: cancelling one of its futures stops no computation. A
task is a coroutine here, which has it computed by a process of the engine, and kills that process
once Dask no longer wants the result.
"""

from __future__ import annotations

import asyncio
import hashlib
import pickle
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import joulepath
from joulepath.app.engine.pool import Engine
from joulepath.app.engine.task import Task
from joulepath.app.engine.warm_up import warm
from joulepath.app.engine.work import Ended, Work, taking
from joulepath.app.exceptions.queue import WorkerLost
from joulepath.app.settings import read_settings
from joulepath.optimizer.progress import Event, no_listener

if TYPE_CHECKING:
    from distributed import Worker

RESOURCES = "joulepath-"
"""What the resources of all versions begin with."""
LOOK = 0.2
"""Time [s] between two looks at whether the result is still wanted, and at what was found."""
_WANTED = ("executing", "long-running", "resumed")
"""States of a task, in a Dask worker, whose result somebody waits for."""
_engines: WeakKeyDictionary[Worker, Engine] = WeakKeyDictionary()

_CODE = ("*.py", "*.c", "*.yaml")


@cache
def version() -> str:
    """A digest of the code and the figures of this installation: objects that travel are read by
    the same ones only.
    """
    digest = hashlib.sha256()
    package = Path(joulepath.__file__).parent
    for folder in sorted(each for each in package.iterdir() if each.is_dir()):
        for file in sorted(file for kind in _CODE for file in folder.rglob(kind)):
            digest.update(f"{file.relative_to(package)}\n".encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def resource() -> str:
    """Dask's name for one process of an engine of this version.

    A worker without this module, or of another version, has none, and gets no task of ours.
    """
    return f"{RESOURCES}{version()}"


Asked = tuple[Task, float, bool]
"""A task, its deadline [s], and whether somebody listens to what it finds."""


async def dask_setup(worker: Worker) -> None:
    """Starts the engine, with one process for each thread that the Dask worker has."""
    settings = read_settings().model_copy(update={"workers": worker.state.nthreads})
    _engines[worker] = engine = Engine(settings, partial(warm, settings.robots))
    engine.start()
    for resources in (worker.state.total_resources, worker.state.available_resources):
        resources[resource()] = float(settings.workers)


async def dask_teardown(worker: Worker) -> None:
    """Stops the engine. Dask has what it was at work on done elsewhere."""
    if worker in _engines:
        await _engines[worker].stop()


async def compute(asked: list[Asked], key: str, topic: str) -> list[Ended]:
    """How each of several tasks ended, as `SpareWorkers.run` has it. Runs in a Dask worker, as its
    task `key`.

    One worker computes them, one after another. What a task finds goes to those who subscribed to
    `topic`.
    """
    from distributed import Reschedule, get_worker

    worker = get_worker()
    engine, found, ended = _engines[worker], list[tuple[int, Event]](), dict[int, Ended]()
    works = [_work(index, each, found, ended) for index, each in enumerate(asked)]
    working = asyncio.create_task(_all(works, ended, engine))
    try:
        while not working.done() and _is_wanted(worker, key):
            await asyncio.wait({working}, timeout=LOOK)
            if found:
                worker.log_event(topic, {"key": key, "events": pickle.dumps(found)})
                found.clear()
        if not working.done():
            raise Reschedule
        working.result()
        if engine.draining and any(isinstance(each, WorkerLost) for each in ended.values()):
            raise Reschedule
        return [ended[index] for index in range(len(works))]
    finally:
        working.cancel()
        await asyncio.gather(working, return_exceptions=True)


def _work(
    index: int, asked: Asked, found: list[tuple[int, Event]], ended: dict[int, Ended]
) -> Work:
    task, deadline, is_heard = asked
    tell = (lambda event: found.append((index, event))) if is_heard else no_listener
    return Work(task, deadline, partial(ended.__setitem__, index), stoppable=False, tell=tell)


async def _all(works: list[Work], ended: dict[int, Ended], engine: Engine) -> None:
    # a worker that dies, or is killed at a deadline, leaves the rest to another one
    while left := [work for index, work in enumerate(works) if index not in ended]:
        await engine.spare.run(taking(*left))


def _is_wanted(worker: Worker, key: str) -> bool:
    state = worker.state.tasks.get(key)
    return state is not None and state.state in _WANTED
