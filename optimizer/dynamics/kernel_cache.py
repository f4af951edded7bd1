"""Compiled kernels on disk: the cache holds one library per robot, whose name has a digest of all
it depends on.
"""

from __future__ import annotations

import hashlib
import os
from importlib.metadata import version
from pathlib import Path

import numpy as np

import joulepath.models.robot
from joulepath.models.robot import Robot
from joulepath.optimizer.dynamics import inverse_dynamics, kernel_expressions, kernel_source, losses
from joulepath.optimizer.dynamics.kernel_expressions import SYMBOLICS, build
from joulepath.optimizer.dynamics.kernel_source import PORTABLE, Vectors, source, vectors
from joulepath.optimizer.native import library_cache
from joulepath.optimizer.native.library_cache import (
    PATIENCE,
    Patience,
    cache_directory,
    compile_library,
)

# at -O1 it takes twice as long to compile, and runs a tenth faster: the code is one long run of
# multiplications. All processors round alike without contraction
COMPILER_FLAGS = ("-Og", "-fPIC", "-shared", "-fno-math-errno", "-ffp-contract=off", "-Wno-psabi")
# modules whose code decides what is compiled
SOURCES = (joulepath.models.robot, inverse_dynamics, losses, kernel_expressions, kernel_source)


def digest(robot: Robot, using: Vectors) -> str:
    """Hash of everything that the compiled functions depend on: the chain, the sources, versions,
    compiler flags.
    """
    h = hashlib.sha256()
    for path in (*(str(module.__file__) for module in SOURCES), __file__, library_cache.__file__):
        h.update(Path(path).read_bytes())
    h.update(repr((version("casadi"), COMPILER_FLAGS, using, os.uname().machine)).encode())
    h.update(repr(robot.has_load_friction).encode())
    flange = robot.model.frames[robot.model.getFrameId("flange")].placement
    constants = [placement.homogeneous for placement in [*robot.model.jointPlacements, flange]]
    constants += [body.toDynamicParameters() for body in robot.model.inertias]
    for constant in constants:
        # rounded, since the last digit of a sine differs between processors; + 0.0 makes -0.0 and
        # 0.0 one
        h.update((np.round(constant, 12) + 0.0).tobytes())
    return h.hexdigest()[:24]


def library_path(robot: Robot, using: Vectors) -> Path:
    """Path of a robot's compiled kernel."""
    return cache_directory() / f"{robot.name}-{digest(robot, using)}.so"


def library_paths(robot: Robot) -> list[Path]:
    """Paths of the compiled kernels that this machine can use, the fastest first."""
    return list(dict.fromkeys(library_path(robot, using) for using in (vectors(), PORTABLE)))


def compile_kernel(robot: Robot, portable: bool = False, patience: Patience = PATIENCE) -> Path:
    """Compile a robot's functions, once however many threads and processes ask. Returns the path of
    the library.

    It is for this machine's processor, or, if `portable`, for every one of its kind, which takes
    twice as long to run. Raises as `compile_library`.
    """
    count, flags = using = PORTABLE if portable else vectors()
    target = library_path(robot, using)
    compile_library(target, (*COMPILER_FLAGS, *flags), lambda: _source(robot, count), patience)
    return target


def _source(robot: Robot, count: int) -> str:
    """The functions of a robot as C, of so many nodes at once; their expressions are freed before
    the lock is.
    """
    with SYMBOLICS:
        return source(build(robot), count)
