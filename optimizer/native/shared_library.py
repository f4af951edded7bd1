"""The C library shared by all arms: forward kinematics, distances and terms of dual bounds for many
configurations at once.

A wheel build compiles it beside this file by `build`, and `make` does so in a clone. It runs on
every processor of its architecture.
"""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import numpy as np

from joulepath.optimizer.native.build import FOLDER, LIBRARY, sources_digest

_LONG = ctypes.c_long
_DOUBLE = ctypes.c_double
_ARRAY = ctypes.c_void_p
# Arguments and result of every C function.
_FUNCTIONS: dict[str, tuple[list[Any], Any]] = {
    "link_frames": ([_LONG, _LONG, *3 * [_ARRAY]], None),
    "bounds": ([_ARRAY, _LONG, _ARRAY, _LONG, _ARRAY, _DOUBLE, _LONG, *4 * [_ARRAY]], _LONG),
    "bead_bounds": ([_ARRAY, _ARRAY, _LONG, *3 * [_ARRAY]], None),
    "witness_points": ([_ARRAY, _ARRAY, _LONG, *2 * [_ARRAY], _DOUBLE, *3 * [_ARRAY]], None),
    "is_clear_between": ([*3 * [_ARRAY], _LONG, _ARRAY], _LONG),
    "segment_segments": ([_LONG, *5 * [_ARRAY]], None),
    "box_segments": ([_LONG, *5 * [_ARRAY]], None),
    "separations": ([_ARRAY, _ARRAY, _LONG, *6 * [_ARRAY]], None),
    "supports": ([_ARRAY, _ARRAY, _LONG, *4 * [_ARRAY]], None),
    "gradients": ([_ARRAY, _ARRAY, _LONG, *5 * [_ARRAY]], None),
    "joint_inertias": ([_ARRAY, _LONG, *2 * [_ARRAY]], None),
    "grid_points": ([_ARRAY, *2 * [_LONG], _DOUBLE, *9 * [_ARRAY]], None),
    "cell_deviation": ([*5 * [_LONG], *8 * [_ARRAY]], None),
    "least_potential": ([*5 * [_LONG], *15 * [_ARRAY], _DOUBLE, *7 * [_ARRAY]], None),
    "speed_conjugate": ([*3 * [_ARRAY], *2 * [_DOUBLE], *2 * [_LONG], *5 * [_ARRAY]], None),
}
_REMEDY = (
    f"`make ready` compiles it in a clone, and `python {FOLDER / 'build.py'}` wherever there is "
    "a C compiler. Or reinstall joulepath, from a wheel for this platform or the source archive."
)


class LibraryUnusable(ImportError):
    """The C library is missing, does not fit this machine, or was compiled from other sources."""

    def __init__(self, path: Path, cause: str) -> None:
        super().__init__(f"The C library {path} {cause}. {_REMEDY}", path=str(path))


def load(path: Path) -> ctypes.CDLL:
    """Library of a file, with declared argument types of its functions.

    Raises:
        LibraryUnusable: the file is missing, does not fit this machine or other sources.
    """
    if not path.is_file():
        raise LibraryUnusable(path, "is missing")
    try:
        library = ctypes.CDLL(str(path))
        digest = library.sources_digest
    except (OSError, AttributeError) as error:
        raise LibraryUnusable(path, f"cannot be loaded: {error}") from error
    digest.restype = ctypes.c_char_p
    # A library of other sources would misread the arguments.
    if digest() != sources_digest().encode():
        raise LibraryUnusable(path, "was compiled from other sources than the current ones")
    for name, (arguments, result) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.argtypes, function.restype = arguments, result
    return library


library = load(LIBRARY)


def address(array: np.ndarray[Any, Any]) -> int:
    """Address of the numbers of a contiguous array."""
    return array.ctypes.data
