"""The choice of tests with a C compiler: only the tests of its products."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

FOUND = os.environ.get("CC")
"""What names it in the environment of the tests."""


@contextmanager
def without_compiler() -> Iterator[None]:
    """Kernels missing from the cache are interpreted, also in services.

    The few motions of a test take less time than the compiler, which needs 5 to 12 s for a kernel.
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("CC", "")
        yield


@contextmanager
def with_compiler() -> Iterator[None]:
    """The compiler of this machine, or the one installed by `make`."""
    with pytest.MonkeyPatch.context() as patched:
        if FOUND is None:
            patched.delenv("CC", raising=False)
        else:
            patched.setenv("CC", FOUND)
        yield
