"""The console command in this process."""

from __future__ import annotations

import pytest
from starlette.testclient import TestClient

import joulepath.app.client.client
from joulepath.app.client.client import Client
from tests.app.cli.console import Here
from tests.app.live import LOCAL


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]) -> Here:
    return Here(monkeypatch, capfdbinary)


@pytest.fixture
def service(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    """The commands reach the service in this process."""

    class Shared(Client):
        def __init__(self, url: str, key: str | None = None) -> None:
            assert url == LOCAL
            super().__init__(url, key, http=client)

        def close(self) -> None:
            """Leaves the shared client open."""

    monkeypatch.setattr(joulepath.app.client.client, "Client", Shared)
    monkeypatch.setattr("joulepath.app.cli.jobs.PERIOD", 0.05)
    monkeypatch.setenv("JOULEPATH_URL", LOCAL)
