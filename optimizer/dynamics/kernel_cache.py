"""Cache of compiled kernels on disk: one library per robot, named by a digest of all its inputs."""

from __future__ import annotations

import hashlib
import os
from importlib.metadata import version
from pathlib import Path

import numpy as np

import joulepath.models.robot
from joulepath.models.robot import Robot, flange_placement
from joulepath.optimizer.dynamics import inverse_dynamics, kernel_expressions, kernel_source, losses
from joulepath.optimizer.dynamics.kernel_expressions import SYMBOLICS, build
from joulepath.optimizer.dynamics.kernel_source import PORTABLE, VectorUnit, source, widest_vectors
from joulepath.optimizer.native import library_cache
from joulepath.optimizer.native.library_cache import (
    CACHE,
    CacheSettings,
    cache_directory,
    compile_library,
)

COMPILER_FLAGS = ("-Og", "-fPIC", "-shared", "-fno-math-errno", "-ffp-contract=off", "-Wno-psabi")
"""Compiler flags. The code is one long run of multiplications: -O1 takes twice as long to compile
and runs only a tenth faster. Without contraction, all processors round equally.
"""

SOURCE_MODULES = (
    joulepath.models.coupling,
    joulepath.models.immutable,
    joulepath.models.robot,
    inverse_dynamics,
    losses,
    kernel_expressions,
    kernel_source,
)
"""Modules that determine the compiled code."""


def digest(robot: Robot, vectors: VectorUnit) -> str:
    """Hash of all inputs of the compiled functions: the chain, sources, versions and compiler
    flags.
    """
    h = hashlib.sha256()
    for path in (
        *(str(module.__file__) for module in SOURCE_MODULES),
        __file__,
        library_cache.__file__,
    ):
        h.update(Path(path).read_bytes())
    h.update(repr((version("casadi"), COMPILER_FLAGS, vectors, os.uname().machine)).encode())
    h.update(repr((robot.has_load_friction, robot.coupling)).encode())
    flange = flange_placement(robot.model)
    constants = [placement.homogeneous for placement in [*robot.model.jointPlacements, flange]]
    constants += [body.toDynamicParameters() for body in robot.model.inertias]
    for constant in constants:
        # Rounded, since the last digit of a sine differs between processors; + 0.0 turns -0.0 into
        # 0.0.
        h.update((np.round(constant, 12) + 0.0).tobytes())
    return h.hexdigest()[:24]


def library_path(robot: Robot, vectors: VectorUnit) -> Path:
    """Path of a robot's compiled kernel."""
    return cache_directory() / f"{robot.name}-{digest(robot, vectors)}.so"


def library_paths(robot: Robot) -> list[Path]:
    """Paths of the compiled kernels that this machine can run, the fastest first."""
    return list(
        dict.fromkeys(library_path(robot, vectors) for vectors in (widest_vectors(), PORTABLE))
    )


def compile_kernel(robot: Robot, portable: bool = False, settings: CacheSettings = CACHE) -> Path:
    """Compiles a robot's functions, once for any number of threads and processes that ask.

    Args:
        robot: the robot.
        portable: whether the library runs on every processor of this architecture, at half the
            speed, instead of using the vectors of this machine's processor.
        settings: time limits of the compilation.

    Returns:
        Path of the library.

    Raises:
        RuntimeError, OSError: as `compile_library`.
    """
    vectors = PORTABLE if portable else widest_vectors()
    target = library_path(robot, vectors)
    flags = (*COMPILER_FLAGS, *vectors.flags)
    compile_library(target, flags, lambda: _source(robot, vectors.lanes), settings)
    return target


def _source(robot: Robot, lanes: int) -> str:
    """C code of the functions of a robot. Expressions are freed before the lock is released."""
    with SYMBOLICS:
        return source(build(robot), lanes)
