"""The library that every arm shares: forward kinematics, distances and the terms of dual bounds, of many
configurations at once.

It serves on every processor of this kind. Where there is none, since there is no compiler or no place for it, and while
the compiler runs, numpy computes the same, several times as slowly.
"""

from __future__ import annotations

import ctypes
import hashlib
import logging
import os
import threading
from pathlib import Path
from typing import Any

import numpy as np

from joulepath.optimizer.native.library_cache import cache_directory, compile_library, compiler, is_intact, mark_used

log = logging.getLogger(__name__)

SOURCES = ("vectors.c", "chain.c", "distances.c", "grid_points.c", "least_potential.c", "speed_conjugate.c")
# all processors round alike without contraction
FLAGS = ("-O3", "-fno-trapping-math", "-fPIC", "-shared", "-fno-math-errno", "-ffp-contract=off")

_LONG, _DOUBLE, _ARRAY = ctypes.c_long, ctypes.c_double, ctypes.c_void_p
# arguments and result of every function: those of the C
_FUNCTIONS = {
    "link_frames": ([_LONG, _LONG, *3 * [_ARRAY]], None),
    "bounds": ([_ARRAY, _LONG, _ARRAY, _LONG, _ARRAY, _DOUBLE, _LONG, *4 * [_ARRAY]], _LONG),
    "bead_bounds": ([_ARRAY, _ARRAY, _LONG, *3 * [_ARRAY]], None),
    "witness_points": ([_ARRAY, _ARRAY, _LONG, *5 * [_ARRAY]], None),
    "separations": ([_ARRAY, _ARRAY, _LONG, *6 * [_ARRAY]], None),
    "gradients": ([_ARRAY, _ARRAY, _LONG, *5 * [_ARRAY]], None),
    "joint_inertias": ([_ARRAY, _LONG, *2 * [_ARRAY]], None),
    "grid_points": ([_ARRAY, *2 * [_LONG], _DOUBLE, *9 * [_ARRAY]], None),
    "cell_deviation": ([*5 * [_LONG], *8 * [_ARRAY]], None),
    "least_potential": ([*5 * [_LONG], *15 * [_ARRAY], _DOUBLE, *7 * [_ARRAY]], None),
    "speed_conjugate": ([*3 * [_ARRAY], *2 * [_DOUBLE], *2 * [_LONG], *5 * [_ARRAY]], None),
}


def source() -> str:
    """The C of the library."""
    return "".join((Path(__file__).parent / name).read_text(encoding="utf-8") for name in SOURCES)


def library_path() -> Path:
    """Path of the library."""
    depends_on = f"{source()}{FLAGS}{os.uname().machine}"
    return cache_directory() / f"shared-{hashlib.sha256(depends_on.encode()).hexdigest()[:24]}.so"


def compile_shared() -> Path:
    """Compile the library if that has not been done, and return its path. Raises as `compile_library`."""
    path = library_path()
    # where the cache is read-only, as in an image, there is no lock to take
    if not is_intact(path):
        compile_library(path, FLAGS, source)
    return path


class _Loader:
    """Loads the library once, for any number of threads. A thread of its own compiles it where it is missing, so that
    no caller's deadline depends on the compiler; it is tried once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._tried = False
        self._library: ctypes.CDLL | None = None
        self._compiling: threading.Thread | None = None

    def get(self, patience: float) -> ctypes.CDLL | None:
        if not self._tried:
            with self._lock:
                if not self._tried:
                    self._begin()
                    self._tried = True
        if patience and self._compiling is not None:
            self._compiling.join(patience)
        # read once: the thread only ever sets it
        return self._library

    def _begin(self) -> None:
        if is_intact(library_path()):
            self._load()
        elif compiler() is not None:
            self._compiling = threading.Thread(target=self._load, name="library-compiler", daemon=True)
            self._compiling.start()

    def _load(self) -> None:
        try:
            path = compile_shared()
            library = ctypes.CDLL(str(path))
        except (RuntimeError, OSError) as error:
            log.warning("the shared library is not compiled, numpy serves: %s", error)
            return
        mark_used(path)
        for name, (arguments, result) in _FUNCTIONS.items():
            function = getattr(library, name)
            function.argtypes, function.restype = arguments, result
        self._library = library


_loader = _Loader()


def shared_library(patience: float = 0.0) -> ctypes.CDLL | None:
    """The library; None if it cannot be compiled, or if that takes longer than `patience` [s] yet.

    The first call has it compiled in the background, which takes half a second, if that has not been done.
    """
    return _loader.get(patience)


def address(array: np.ndarray[Any, Any]) -> int:
    """Address of the numbers of an array, which must lie one after the other."""
    return array.ctypes.data
