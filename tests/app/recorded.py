"""The service with recorded results of searches, so tests of HTTP need no search.

`python -m tests.app.recorded` is such a service, `python -m tests.app.recorded record` writes the
recordings anew.
"""

from __future__ import annotations

import asyncio
import itertools
import pickle
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from pathlib import Path
from typing import Any

import orjson
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.api.compare.task import CompareRequest, CompareTask
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import CycleTask
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.pareto.task import ParetoRequest, ParetoTask
from joulepath.app.convert.json_text import sent
from joulepath.app.engine import forkserver, pool
from joulepath.app.engine.result import StoredAnswer, TaskResult
from joulepath.app.engine.task import Ended, Take, Task, Work, outcome
from joulepath.app.main import create_app
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.settings import Settings
from joulepath.optimizer.deadline import Stopped
from joulepath.optimizer.progress import Tell, no_listener
from tests.app.live import COMPUTED, LOCAL, WARM_UP
from tests.app.requests import HOME, NEAR, PATIENT

FOLDER = Path(__file__).parent / "recordings"
SENT = "recorded"
"""Id of the recorded requests."""
MOVE: dict[str, Any] = {
    "start": {"q": HOME},
    "goal": {"q": NEAR},
    "candidates": "none",
    "sample_period": 0.25,
}
CYCLE: dict[str, Any] = {
    "start": {"q": HOME},
    "stops": [{"target": {"q": NEAR}}],
    "candidates": "none",
}
TASKS: dict[str, Task] = {
    "optimize": OptimizeTask(OptimizeRequest.model_validate(MOVE), SENT),
    "compare": CompareTask(
        CompareRequest.model_validate(MOVE | {"methods": ["time_scaling"]}), SENT
    ),
    "pareto": ParetoTask(ParetoRequest.model_validate(MOVE | {"points": 2}), SENT, "json"),
    "cycle": CycleTask(CycleRequest.model_validate(CYCLE | {"sample_period": 0.25}), SENT),
}
"""What is recorded, by the endpoint."""
_ID = re.compile(rb"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_is_recorded: ContextVar[bool] = ContextVar("is_recorded", default=False)
_count = itertools.count(1)


def record(kind: str) -> dict[str, Any]:
    """The recording of a kind, made by the optimiser."""
    result = TASKS[kind].run(PATIENT["deadline"])
    return {
        "document": orjson.loads(result.document),
        "stored": [orjson.loads(each.body) for each in result.stored],
        "figures": vars(result.figures),
    }


def recorded(kind: str, request_id: str) -> TaskResult:
    """The recorded result as the result of a request, with new ids and a new wall time."""
    text = (FOLDER / f"{kind}.json").read_bytes()
    for number, old in enumerate(dict.fromkeys(_ID.findall(text))):
        text = text.replace(old, b"%08x%s" % (next(_count) * 64 + number, old[8:]))
    content = orjson.loads(text)
    document, stored = content["document"], content["stored"]
    for each in (document, *stored):
        each["request"] = request_id
        if "solver" in each:
            each["solver"]["wall_time"] = next(_count) * 1e-4
    figures = AnswerFigures(**content["figures"])
    if figures.energy is None:
        return TaskResult.of_json(document, tuple(map(_stored, stored)))
    return TaskResult.of_kept_json(document, figures, tuple(map(_stored, stored)))


def _stored(document: dict[str, Any]) -> StoredAnswer:
    return StoredAnswer(document["id"], orjson.dumps(document))


def _instead_of(
    kind: str, run: Callable[[Any, float], TaskResult]
) -> Callable[[Any, float], TaskResult]:
    def instead(task: Any, deadline: float) -> TaskResult:
        if not _is_recorded.get():
            return run(task, deadline)
        # as a process receives it: a large body stays pickled until then
        asked = sent(pickle.loads(pickle.dumps(task.request)))
        return replace(recorded(kind, task.request_id), asked=asked)

    return instead


class RecordedWorker:
    """A worker in a thread of the service with recorded searches; other tasks are run."""

    alive, is_free, pid = True, True, None

    def __init__(self, *_: object) -> None:
        self.ended = asyncio.Event()

    async def start(self) -> None:
        """Starts the worker, which is warm at once."""

    def when_free(self, call: Callable[[], object]) -> None:
        call()

    async def ask(self, task: Task, deadline: float, tell: Tell = no_listener) -> TaskResult:
        ended = await asyncio.to_thread(_ended, task, deadline)
        if isinstance(ended, TaskResult):
            return ended
        raise ended

    async def ask_all(
        self, first: Work, take: Take, turn: Callable[[Work, Ended, Work | None], object]
    ) -> None:
        work: Work | None = first
        while work is not None:
            ended = await asyncio.to_thread(_ended, work.task, work.deadline)
            last, work = work, take()
            turn(last, ended, work)

    def stop(self) -> None:
        """Does nothing: the tasks end by themselves."""

    def kill(self) -> None:
        self.ended.set()


def _ended(task: Task, deadline: float) -> Ended:
    # a thread of its own has a copy of the context
    _is_recorded.set(True)
    ended = outcome(task, deadline)
    assert not isinstance(ended, Stopped), "nothing is told to stop"
    return ended


@contextmanager
def recorded_workers() -> Iterator[None]:
    """A context in which services start with recorded workers and keep them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pool, "Worker", RecordedWorker)
        for module in (pool, forkserver):
            patch.setattr(module, "start_forkserver", lambda: None)
        yield


def _use_recordings() -> None:
    """Gives recordings to tasks of recorded workers alone, because jobs make tasks of their own."""
    for kind, task in TASKS.items():
        searching: Any = type(task)
        searching.run = _instead_of(kind, searching.run)


_use_recordings()


@contextmanager
def recorded_service(**settings: Any) -> Iterator[TestClient]:
    """A service with recorded results in this process."""
    app = create_app(Settings(workers=2, queue_size=4, **settings))
    client = TestClient(app, base_url=LOCAL, raise_server_exceptions=False, headers=COMPUTED)
    with recorded_workers():
        client.__enter__()
        end = time.monotonic() + WARM_UP
        while client.get("/readyz").status_code != 200:
            assert time.monotonic() < end
            time.sleep(0.01)
    try:
        yield client
    finally:
        client.__exit__()


def main() -> None:
    """Serves, or writes the recordings."""
    if sys.argv[1:] == ["record"]:
        FOLDER.mkdir(exist_ok=True)
        for kind in TASKS:
            (FOLDER / f"{kind}.json").write_bytes(orjson.dumps(record(kind)) + b"\n")
        return
    from joulepath.app import __main__

    with recorded_workers():
        __main__.main()


if __name__ == "__main__":
    main()
