"""One machine of a cluster: an engine inside a Dask worker, as `dask worker --preload app.cluster` starts it.

Dask carries tasks. It does not compute them: cancelling one of its futures stops no computation. A task is a coroutine
here, which has it computed by a process of the engine, and kills that process once Dask no longer wants the result.
"""

from __future__ import annotations

import asyncio
import pickle
from functools import partial
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from app.engine.pool import Engine
from app.engine.result import TaskResult
from app.engine.task import Task
from app.engine.warm_up import warm
from app.exceptions import ServiceError, WorkerDied
from app.settings import read_settings
from optimizer.exceptions import JoulepathError
from optimizer.progress import Event, nobody

if TYPE_CHECKING:
    from distributed import Worker

RESOURCE = "joulepath"
"""Dask's name for one process of an engine. A worker without this module has none, and gets no task of ours."""
LOOK = 0.2
"""Time [s] between two looks at whether the result is still wanted, and at what was found."""
_WANTED = ("executing", "long-running", "resumed")
"""States of a task, in a Dask worker, whose result somebody waits for."""
_engines: WeakKeyDictionary[Worker, Engine] = WeakKeyDictionary()

Ended = TaskResult | JoulepathError | ServiceError


async def dask_setup(worker: Worker) -> None:
    """Starts the engine, with one process for each thread that the Dask worker has."""
    settings = read_settings().model_copy(update={"workers": worker.state.nthreads})
    _engines[worker] = engine = Engine(settings, partial(warm, settings.robots))
    engine.start()
    for resources in (worker.state.total_resources, worker.state.available_resources):
        resources[RESOURCE] = float(settings.workers)


async def dask_teardown(worker: Worker) -> None:
    """Stops the engine. Dask has what it was at work on done elsewhere."""
    if worker in _engines:
        await _engines[worker].stop()


async def compute(task: Task, deadline: float, key: str, topic: str | None) -> Ended:
    """The task's result, or its error, as `SpareWorkers.run` has it. Runs in a Dask worker, as its task `key`.

    What the task finds goes to those who subscribed to `topic`, if there is one.
    """
    from distributed import Reschedule, get_worker

    worker = get_worker()
    engine, found = _engines[worker], list[Event]()
    tell = nobody if topic is None else found.append
    working = asyncio.create_task(engine.spare.run(task, deadline, stoppable=False, tell=tell))
    try:
        while not working.done() and _is_wanted(worker, key):
            await asyncio.wait({working}, timeout=LOOK)
            if found:
                worker.log_event(topic or "", {"key": key, "events": pickle.dumps(found)})
                found.clear()
        if not working.done():
            raise Reschedule
        return working.result()
    except (JoulepathError, ServiceError) as error:
        if isinstance(error, WorkerDied) and engine.draining:
            raise Reschedule from None
        return error
    finally:
        working.cancel()
        await asyncio.gather(working, return_exceptions=True)


def _is_wanted(worker: Worker, key: str) -> bool:
    state = worker.state.tasks.get(key)
    return state is not None and state.state in _WANTED
