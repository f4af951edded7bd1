"""The setting of all tests: number of processes, order of the files, databases and the service."""

from __future__ import annotations

import atexit
import gc
import itertools
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.app.forks import fork_forkserver, start_origin
from tests.compilers import with_compiler, without_compiler

if TYPE_CHECKING:
    from starlette.testclient import TestClient

TESTS = Path(__file__).parent
LONG_FOLDERS = (TESTS / "browser", TESTS / "fuzzing")
"""Folders whose tests are all `long`. Otherwise they are not even imported: their libraries take
seconds to load.
"""
LONG_TIMEOUT = 3600.0
"""Time after which a long test counts as hanging [s]."""
DATABASES = tempfile.TemporaryDirectory(prefix="joulepath-tests-")
_count = itertools.count()


def pytest_xdist_auto_num_workers() -> int:
    """One process more than cores: some tests wait for a service of their own to start or
    to end.
    """
    return len(os.sched_getaffinity(0)) + 1


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Skips the long folders where long tests are deselected, and the node's tests without rclpy.

    `test_ros2.py` runs the tests of the node in an environment with rclpy. None leaves the decision
    to pytest.
    """
    is_long = collection_path in LONG_FOLDERS and config.option.markexpr == "not long"
    needs_ros = collection_path == TESTS / "ros2" and find_spec("rclpy") is None
    return True if is_long or needs_ros else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests of the long folders and moves the slowest tests to the front.

    At the end of the run, one process would be busy with a slow test while the others idle. Long
    tests have a longer timeout: some take minutes on an idle machine.
    """
    folders = tuple(f"{folder}/" for folder in LONG_FOLDERS)
    for item in items:
        if str(item.path).startswith(folders):
            item.add_marker("long")
        if item.get_closest_marker("long") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(LONG_TIMEOUT))
    items.sort(key=lambda item: item.path.parent.name not in ("browser", "deploy", "tests"))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Keeps the garbage collector away from modules and tests, which live until the end.

    To look at them takes the collector a fifth of the time of loading.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
        # Objects are freed again at the exit, lest libraries warn of leaks.
        atexit.register(gc.unfreeze)


def pytest_configure(config: pytest.Config) -> None:
    """Makes the folder and the forking process of all processes with tests.

    Programs under test are forks of this process. It loads the package while the others load the
    tests.
    """
    os.environ.setdefault("PYTEST_SHARED_FOLDER", DATABASES.name)
    if config.getoption("numprocesses", None):
        start_origin()


def pytest_unconfigure() -> None:
    DATABASES.cleanup()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Gives each test an empty database of its own, also for its commands and programs."""
    os.environ["JOULEPATH_DATABASE_URL"] = f"sqlite:///{DATABASES.name}/{next(_count)}.db"


@pytest.fixture(scope="session", autouse=True)
def _without_compiler() -> Iterator[None]:
    with without_compiler():
        yield


@pytest.fixture(scope="session", autouse=True)
def _forked_workers(_without_compiler: None) -> None:
    """Forks the workers of services from this process in its state before the first test.

    Workers import nothing again and have no traces of a test.
    """
    fork_forkserver()
    if engine := sys.modules.get("joulepath.app.engine.forkserver"):
        engine.start_forkserver()


@pytest.fixture
def compiler() -> Iterator[None]:
    """The C compiler, which the other tests do without."""
    with with_compiler():
        yield


@pytest.fixture(scope="session")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """The service in this process with a database of its own, its two workers warm."""
    # tests of the library alone do not wait until the service is imported
    from starlette.testclient import TestClient

    from joulepath.app.main import create_app
    from joulepath.app.settings import Settings
    from tests.app.documents import open_document
    from tests.app.live import COMPUTED, GRACE, LOCAL, WARM_UP
    from tests.app.shared import migrated

    database = migrated(tmp_path_factory.mktemp("service"))
    settings = Settings(workers=2, queue_size=4, deadline_grace=GRACE, database_url=database)
    app = create_app(settings)
    app.openapi_schema = open_document()  # to build it takes a second
    with TestClient(app, base_url=LOCAL, raise_server_exceptions=False, headers=COMPUTED) as client:
        end = time.monotonic() + WARM_UP
        while client.get("/readyz").status_code != 200:
            assert time.monotonic() < end, "the workers do not warm up"
            time.sleep(0.05)
        yield client
