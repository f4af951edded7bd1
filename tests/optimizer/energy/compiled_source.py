"""Functions compiled from the C of `kernel_source`, and called."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np

from models.robot import Array
from optimizer.energy.kernel_cache import COMPILER_FLAGS, compiler
from optimizer.energy.kernel_source import source


def library(functions: list[ca.Function], lanes: int, folder: Path) -> Path:
    """The functions compiled for so many nodes at once, without optimisation."""
    code, target = folder / "kernel.c", folder / "kernel.so"
    code.write_text(source(functions, lanes))
    command = compiler()
    assert command is not None
    subprocess.run([command, *COMPILER_FLAGS, "-O0", str(code), "-o", str(target), "-lm"], check=True)
    return target


def of_rows(path: Path, name: str, x: Array) -> Array:
    """A library's function of one number, and of a parameter that it does not use, at numbers (k,)."""
    found, unused = np.empty_like(x), np.zeros(1)
    given = (ctypes.c_void_p * 2)(x.ctypes.data, unused.ctypes.data)
    getattr(ctypes.CDLL(str(path)), name)(ctypes.c_long(len(x)), given, (ctypes.c_void_p * 1)(found.ctypes.data))
    return found
