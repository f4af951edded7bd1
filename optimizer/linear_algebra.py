"""Linear algebra kept to one thread per caller: the matrices are small, so more threads cost more than they give.

Some BLAS libraries have one limit per thread, others one for the whole process. So every thread that enters sets the
limit, and the last thread that leaves lifts it: whichever threads compute at the same time, all of them compute with
one, and round alike.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from threadpoolctl import OpenBLASController, ThreadpoolController


class _Own(threading.local):
    """The calling thread's contexts: how many are open, and the numbers of BLAS threads before the first."""

    depth = 0
    before: tuple[int, ...] = ()


class _SharedLimit:
    """The BLAS libraries of the process, and the threads in which they are limited."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._own = _Own()
        self._users = 0
        self._before: tuple[int, ...] = ()
        self._libraries: list[Any] = []

    def enter(self) -> None:
        self._own.depth += 1
        if self._own.depth > 1:
            return
        with self._lock:
            # finding the libraries takes milliseconds
            self._libraries = self._libraries or [
                library for library in ThreadpoolController().lib_controllers if library.user_api == "blas"
            ]
            self._own.before = tuple(library.num_threads for library in self._libraries)
            if self._users == 0:
                self._before = self._own.before
            self._users += 1
            self._set((1,) * len(self._libraries))

    def leave(self) -> None:
        self._own.depth -= 1
        if self._own.depth > 0:
            return
        with self._lock:
            self._users -= 1
            # a limit of the process was 1 before all threads but the first: only the last one to leave lifts it
            self._set(self._own.before if self._users else self._before)

    def _set(self, counts: tuple[int, ...]) -> None:
        for library, count in zip(self._libraries, counts, strict=True):
            # threadpoolctl lets one thread at a time set OpenBLAS's limit and ignores the others
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
