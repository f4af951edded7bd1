"""How many processes run the tests, which files they begin with, and which folders `make test-long`
alone runs.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
LONG_FOLDERS = (TESTS / "browser", TESTS / "fuzzing")
"""Folders whose tests are all `long`. Otherwise they are not even imported: their libraries take
seconds to load.
"""


def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: some tests wait for a service of their own to start or to
    end."""
    return len(os.sched_getaffinity(0)) + 1


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Skips the long folders where long tests are deselected, and the tests that need rclpy where
    it is not installed: `test_ros2.py` runs them. None leaves the decision to pytest."""
    is_long = collection_path in LONG_FOLDERS and config.option.markexpr == "not long"
    needs_ros = collection_path == TESTS / "ros2" and find_spec("rclpy") is None
    return True if is_long or needs_ros else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests of the long folders, and puts the few tests that take long to the front: at
    the end, one process would be busy with them while the others idle."""
    for item in items:
        if any(folder in item.path.parents for folder in LONG_FOLDERS):
            item.add_marker("long")
    items.sort(key=lambda item: item.path.parent.name not in ("browser", "deploy", "tests"))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Modules and tests stay until the end: the garbage collector takes a fifth of the time that it
    takes to load them, and need not look at them afterwards."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_unconfigure() -> None:
    """Libraries warn of objects that nobody could free."""
    gc.unfreeze()
