"""The service as tests reach it: in this process, with searches or with recorded ones, and as a
server of its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest
from starlette.testclient import TestClient

from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from tests.app.live import COMPUTED, GRACE, LOCAL, WARM_UP, Server, serving
from tests.app.recorded import recorded_service


@pytest.fixture(scope="session", autouse=True)
def _database(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test touches the user's own database."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(
            "JOULEPATH_DATABASE_URL", f"sqlite:///{tmp_path_factory.mktemp('store')}/joulepath.db"
        )
        yield


@pytest.fixture(scope="session")
def client() -> Iterator[TestClient]:
    """The service in this process, its two workers warm."""
    with TestClient(
        create_app(Settings(workers=2, queue_size=4, deadline_grace=GRACE)),
        base_url=LOCAL,
        raise_server_exceptions=False,
        headers=COMPUTED,
    ) as client:
        end = time.monotonic() + WARM_UP
        while client.get("/readyz").status_code != 200:
            assert time.monotonic() < end, "the workers do not warm up"
            time.sleep(0.05)
        yield client


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
