"""The console command in this process."""

from __future__ import annotations

import pytest

from tests.app.cli.console import Here


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]) -> Here:
    return Here(monkeypatch, capfdbinary)
