"""How many processes run the tests, and which files they begin with."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator

import pytest


def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: some tests wait for a service of their own to start or to end."""
    return len(os.sched_getaffinity(0)) + 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files whose few tests take long come first: at the end, a process would be busy with one while others idle."""
    items.sort(key=lambda item: item.path.parent.name not in ("browser", "deploy", "tests"))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Modules and tests stay until the end: the garbage collector takes a fifth of the time that it takes to load them,
    and need not look at them afterwards."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_unconfigure() -> None:
    """Libraries warn of objects that nobody could free."""
    gc.unfreeze()
