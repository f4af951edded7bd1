"""A machine of a cluster: an engine in a Dask worker (`dask worker --preload
joulepath.app.cluster`).

Dask transports tasks without computing them, since cancelling its futures stops no computation. A
task is a coroutine: a process of the engine computes it, and is killed once Dask no longer wants
the result.
"""

from __future__ import annotations

import asyncio
import pickle
from functools import partial
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from joulepath.app.engine.code_version import code_version
from joulepath.app.engine.pool import Engine
from joulepath.app.engine.task import Ended, Task, Work, taking
from joulepath.app.engine.warm_up import warm
from joulepath.app.exceptions.queue import WorkerLost
from joulepath.app.settings import read_settings
from joulepath.optimizer.progress import Told, no_listener

if TYPE_CHECKING:
    from distributed import Worker

RESOURCES = "joulepath-"
"""Prefix of the resources of all versions."""
CHECK_PERIOD = 0.2
"""Time [s] between two checks of Dask's interest and of new events."""
_WANTED = ("executing", "long-running", "resumed")
"""States of a wanted task in a Dask worker."""
_engines: WeakKeyDictionary[Worker, Engine] = WeakKeyDictionary()


def resource() -> str:
    """Dask's name for one process of an engine of this version.

    A worker without this module, or of another version, has none, and gets no task of ours.
    """
    return f"{RESOURCES}{code_version()}"


Asked = tuple[Task, float, bool]
"""A task, its deadline [s], and whether a client listens to its events."""


async def dask_setup(worker: Worker) -> None:
    """Starts the engine with one process per thread of the Dask worker."""
    settings = read_settings().model_copy(update={"workers": worker.state.nthreads})
    _engines[worker] = engine = Engine(settings, partial(warm, settings.robots))
    engine.start()
    for resources in (worker.state.total_resources, worker.state.available_resources):
        resources[resource()] = float(settings.workers)


async def dask_teardown(worker: Worker) -> None:
    """Stops the engine. Dask repeats its unfinished work elsewhere."""
    if worker in _engines:
        await _engines[worker].stop()


async def compute(asked: list[Asked], key: str, topic: str) -> list[Ended]:
    """Outcomes of several tasks, see `SpareWorkers.run`; the task `key` of a Dask worker.

    One worker computes them one after another. Events go to the subscribers of `topic`.
    """
    from distributed import Reschedule, get_worker

    worker = get_worker()
    engine, found, ended = _engines[worker], list[tuple[int, Told]](), dict[int, Ended]()
    works = [_work(index, each, found, ended) for index, each in enumerate(asked)]
    working = asyncio.create_task(_all(works, ended, engine))
    try:
        while not working.done() and _is_wanted(worker, key):
            await asyncio.wait({working}, timeout=CHECK_PERIOD)
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


def _work(index: int, asked: Asked, found: list[tuple[int, Told]], ended: dict[int, Ended]) -> Work:
    task, deadline, is_heard = asked
    tell = (lambda event: found.append((index, event))) if is_heard else no_listener
    return Work(task, deadline, partial(ended.__setitem__, index), stoppable=False, tell=tell)


async def _all(works: list[Work], ended: dict[int, Ended], engine: Engine) -> None:
    # After the end of a worker, another one continues.
    while left := [work for index, work in enumerate(works) if index not in ended]:
        await engine.spare.run(taking(*left))


def _is_wanted(worker: Worker, key: str) -> bool:
    state = worker.state.tasks.get(key)
    return state is not None and state.state in _WANTED
