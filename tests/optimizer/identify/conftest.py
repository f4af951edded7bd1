"""The real logs, shared by several tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.identification_logs import MISSING, folder


@pytest.fixture(scope="session")
def place() -> Path:
    """The folder of the real logs; without it, the test is skipped."""
    found = folder()
    if found is None:
        pytest.skip(MISSING)
    return found
