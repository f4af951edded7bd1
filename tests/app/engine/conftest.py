"""An engine for a test, on an event loop with a clock moved by the test."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.engine.pool import Engine
from joulepath.app.settings import Settings
from tests.app.engine.bench import DEADLINE_GRACE, SHUTDOWN_GRACE, Bench, MovableLoop, until
from tests.app.engine.simple_tasks import no_warm_up
from tests.app.live import alive


@pytest.fixture
def anyio_backend() -> tuple[str, dict[str, Any]]:
    return "asyncio", {"loop_factory": MovableLoop}


@pytest.fixture
async def bench(request: pytest.FixtureRequest, tmp_path: Path) -> AsyncIterator[Bench]:
    """An engine of one worker, with room for one waiting request; `settings` changes it.

    The engine is ready unless it cannot warm up.
    """
    graces = {"deadline_grace": DEADLINE_GRACE, "shutdown_grace": SHUTDOWN_GRACE}
    given = {"workers": 1, "queue_size": 1, **graces, **getattr(request, "param", {})}
    warm = given.pop("warm", no_warm_up)
    loop = asyncio.get_running_loop()
    assert isinstance(loop, MovableLoop)
    engine = Engine(Settings(**given), warm)
    engine.start()
    try:
        if warm is no_warm_up:
            await until(lambda: engine.ready)
        yield Bench(engine, loop, tmp_path)
    finally:
        pids = engine.worker_pids
        await engine.stop()
        assert not any(alive(pid) for pid in pids)
