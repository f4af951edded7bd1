"""Shared by all tests of the library: one thread for linear algebra, and the kernel of the default
robot.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits

from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.problem.robots import load_robot
from tests.compilers import with_compiler


@pytest.fixture(scope="session", autouse=True)
def _one_thread() -> Iterator[None]:
    """One thread of linear algebra, as in `optimize`: more threads slow small matrices down."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture(scope="session", autouse=True)
def _compiled() -> None:
    """Many motions of the default robot take a while without it."""
    with with_compiler():
        compile_kernel(load_robot("ur5e"))
