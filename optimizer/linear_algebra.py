"""Limit of BLAS libraries to one thread per caller: for small matrices, more threads cost more than
they give.

Some BLAS libraries have a limit for every thread, others one for the whole process. Every entering
thread therefore sets the limit; a leaving thread restores its own limit, and the last one the limit
of the process. All threads thus compute with one BLAS thread at any time, and round alike.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from threadpoolctl import OpenBLASController, ThreadpoolController


class _ThreadState(threading.local):
    """Open contexts of the calling thread, and the numbers of BLAS threads before the first one."""

    depth = 0
    before: Sequence[int] = ()


class _SharedLimit:
    """The BLAS libraries of the process, and the number of threads that limit them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._own = _ThreadState()
        self._users = 0
        self._before: Sequence[int] = ()
        self._libraries: list[Any] = []

    def enter(self) -> None:
        self._own.depth += 1
        if self._own.depth > 1:
            return
        with self._lock:
            # the search for the libraries takes milliseconds
            self._libraries = self._libraries or [
                library
                for library in ThreadpoolController().lib_controllers
                if library.user_api == "blas"
            ]
            self._own.before = [library.num_threads for library in self._libraries]
            if self._users == 0:
                self._before = self._own.before
            self._users += 1
            for library in self._libraries:
                _set_threads(library, 1)

    def leave(self) -> None:
        self._own.depth -= 1
        if self._own.depth > 0:
            return
        with self._lock:
            self._users -= 1
            for library, own, shared in zip(
                self._libraries, self._own.before, self._before, strict=True
            ):
                if _counts_per_thread(library):
                    _set_threads(library, own)
                elif self._users == 0:
                    _set_threads(library, shared)


def _counts_per_thread(library: Any) -> bool:
    """Whether threadpoolctl sets a limit per thread: for MKL, and for OpenBLAS on OpenMP."""
    openmp = library.internal_api == "openblas" and library.threading_layer == "openmp"
    return bool(library.internal_api == "mkl" or openmp)


def _set_threads(library: Any, count: int) -> None:
    # threadpoolctl lets one thread at a time set OpenBLAS's limit and silently ignores the others
    OpenBLASController.clear_controlling_thread(force=True)
    library.set_num_threads(count)
    OpenBLASController.clear_controlling_thread(force=True)


_LIMIT = _SharedLimit()


@contextmanager
def one_thread() -> Iterator[None]:
    """Context or decorator in which BLAS libraries use one thread per call."""
    _LIMIT.enter()
    try:
        yield
    finally:
        _LIMIT.leave()
