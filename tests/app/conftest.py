"""The service with recorded searches in this process, and the service as a server of its own."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from starlette.testclient import TestClient

from tests.app.live import GRACE, Server, serving
from tests.app.recorded import recorded_service


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    """`python -m joulepath.app` in a process of its own, warm."""
    with serving(workers=2, queue_size=4, deadline_grace=GRACE, stop_grace=GRACE) as server:
        yield server


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """The service in this process, with recorded results instead of searches. Its database is its
    own, since services with the same one share their jobs."""
    database = f"sqlite:///{tmp_path_factory.mktemp('recorded')}/joulepath.db"
    with recorded_service(database_url=database) as client:
        yield client
