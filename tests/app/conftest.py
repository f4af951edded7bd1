"""The service with recorded searches in this process, and the service as a server of its own."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from joulepath.app.store.store import Store
from tests.app.databases import opened
from tests.app.live import GRACE, Server, serving
from tests.app.recorded import recorded_service
from tests.app.shared import migrated


@pytest.fixture
def anyio_backend() -> str:
    """The event loop of tests that are coroutines."""
    return "asyncio"


@pytest.fixture
def url(tmp_path: Path) -> str:
    """A database without rows."""
    return migrated(tmp_path)


@pytest.fixture
async def store(url: str) -> AsyncIterator[Store]:
    """The store of a database without rows."""
    async with opened(url) as store:
        yield store


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    """`python -m joulepath.app` in a process of its own, warm."""
    with serving(workers=2, queue_size=4, deadline_grace=GRACE, stop_grace=GRACE) as server:
        yield server


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """The service in this process, with recorded results instead of searches.

    It has a database of its own, because services on one database share their jobs.
    """
    database = migrated(tmp_path_factory.mktemp("recorded"))
    with recorded_service(database_url=database) as client:
        yield client
