"""An engine with a clock moved by the test, and tasks to hold its workers."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.engine.pool import Engine
from tests.app.engine.simple_tasks import Hold, ProcessId

# The longest that a busy machine takes for any step below [s]; no test waits for it to pass.
PATIENCE = 120.0
# A deadline, and two graces, out of reach of a busy machine [s]; tests move the clock past them.
LONG = 1000.0
DEADLINE_GRACE = 300.0
SHUTDOWN_GRACE = 500.0


class MovableLoop(asyncio.SelectorEventLoop):
    """An event loop with a clock moved by the test."""

    moved = 0.0

    def time(self) -> float:
        return super().time() + self.moved


class Bench:
    """An engine under test, with tasks that hold its workers until their release by the test."""

    def __init__(self, engine: Engine, loop: MovableLoop, folder: Path) -> None:
        self.engine, self._loop, self._folder = engine, loop, folder
        self._numbers = itertools.count()

    def move_clock(self, seconds: float) -> None:
        self._loop.moved += seconds

    async def held(self, deadline: float = LONG) -> tuple[asyncio.Task[Any], Path]:
        """A task running in a worker; touch the path to let it end."""
        folder = self._folder / str(next(self._numbers))
        folder.mkdir()
        running = asyncio.create_task(self.engine.run(Hold(folder), deadline))
        await until((folder / "started").exists)
        return running, folder / "released"

    async def queued(self, task: Any, deadline: float = LONG) -> asyncio.Task[Any]:
        """A task waiting for a worker."""
        waiting = asyncio.create_task(self.engine.run(task, deadline))
        await asyncio.sleep(0)  # until it waits
        return waiting

    async def pid(self) -> int:
        """Process id of the worker of the next task."""
        return int((await self.engine.run(ProcessId(), LONG)).document)


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.01)


def settings(**given: Any) -> pytest.MarkDecorator:
    """Settings of the engine, and its function `warm`, that differ from the defaults of `bench`."""
    return pytest.mark.parametrize("bench", [given], indirect=True, ids=[",".join(given)])
