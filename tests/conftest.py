"""How many processes run the tests, and which files they begin with."""

from __future__ import annotations

import os

import pytest


def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: some tests wait for a service of their own to start or to end."""
    return len(os.sched_getaffinity(0)) + 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files whose few tests take long come first: at the end, a process would be busy with one while others idle."""
    items.sort(key=lambda item: item.path.parent.name not in ("browser", "deploy", "tests"))
