"""Linear algebra kept to one thread per caller: the matrices are small, so more threads cost more
than they give.

Some BLAS libraries have a limit for each thread, others one for the whole process. So every thread
that enters sets the limit; a thread that leaves lifts its own, and the last one that of the
process. Whichever threads compute at the same time, all of them compute with one, and round alike.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from threadpoolctl import OpenBLASController, ThreadpoolController


class _Own(threading.local):
    """The calling thread's contexts: how many are open, and the numbers of BLAS threads before the
    first.
    """

    depth = 0
    before: Sequence[int] = ()


class _SharedLimit:
    """The BLAS libraries of the process, and the threads in which they are limited."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._own = _Own()
        self._users = 0
        self._before: Sequence[int] = ()
        self._libraries: list[Any] = []

    def enter(self) -> None:
        self._own.depth += 1
        if self._own.depth > 1:
            return
        with self._lock:
            # finding the libraries takes milliseconds
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
                _set(library, 1)

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
                    _set(library, own)
                elif self._users == 0:
                    _set(library, shared)


def _counts_per_thread(library: Any) -> bool:
    """Whether each thread has a limit of its own, as threadpoolctl sets it: MKL, and OpenBLAS on
    OpenMP.
    """
    openmp = library.internal_api == "openblas" and library.threading_layer == "openmp"
    return bool(library.internal_api == "mkl" or openmp)


def _set(library: Any, count: int) -> None:
    # threadpoolctl lets one thread at a time set OpenBLAS's limit and silently ignores the others
    OpenBLASController.clear_controlling_thread(force=True)
    library.set_num_threads(count)
    OpenBLASController.clear_controlling_thread(force=True)


_LIMIT = _SharedLimit()


@contextmanager
def one_thread() -> Iterator[None]:
    """A context, or a decorator, in which BLAS libraries use one thread per call."""
    _LIMIT.enter()
    try:
        yield
    finally:
        _LIMIT.leave()
