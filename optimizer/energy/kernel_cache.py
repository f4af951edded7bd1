"""Compiled kernels on disk: `JOULEPATH_CACHE_DIR` (default `~/.cache/joulepath`) holds one library per robot.

The system's C compiler makes it once. Its name contains a digest of everything that it depends on; beside it lies a
seal, the hash of the library, so that a damaged file is noticed before it is loaded.
"""

from __future__ import annotations

import fcntl
import hashlib
import logging
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path

import numpy as np

import models.robot
from models.robot import Robot
from optimizer.energy import inverse_dynamics, kernel_expressions, kernel_source, losses
from optimizer.energy.kernel_expressions import SYMBOLICS, build
from optimizer.energy.kernel_source import PORTABLE, Vectors, source, vectors

log = logging.getLogger(__name__)

# at -O1 it takes twice as long to compile, and runs a tenth faster: the code is one long run of multiplications. All
# processors round alike without contraction
COMPILER_FLAGS = ("-Og", "-fPIC", "-shared", "-fno-math-errno", "-ffp-contract=off", "-Wno-psabi")
# users may bring any number of arms, each with a library of about a megabyte
MOST_LIBRARIES = 200
# modules whose code decides what is compiled
SOURCES = (models.robot, inverse_dynamics, losses, kernel_expressions, kernel_source)


def cache_directory() -> Path:
    """Folder of the compiled kernels."""
    given = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(given) if given else Path.home() / ".cache" / "joulepath"


def digest(robot: Robot, using: Vectors) -> str:
    """Hash of everything that the compiled functions depend on: the chain, the sources, versions, compiler flags."""
    h = hashlib.sha256()
    for path in (*(str(module.__file__) for module in SOURCES), __file__):
        h.update(Path(path).read_bytes())
    h.update(repr((version("casadi"), COMPILER_FLAGS, using, os.uname().machine)).encode())
    h.update(repr(robot.has_load_friction).encode())
    flange = robot.model.frames[robot.model.getFrameId("flange")].placement
    constants = [placement.homogeneous for placement in [*robot.model.jointPlacements, flange]]
    constants += [body.toDynamicParameters() for body in robot.model.inertias]
    for constant in constants:
        # rounded, since the last digit of a sine differs between processors; + 0.0 makes -0.0 and 0.0 one
        h.update((np.round(constant, 12) + 0.0).tobytes())
    return h.hexdigest()[:24]


def library_path(robot: Robot, using: Vectors) -> Path:
    """Path of a robot's compiled kernel."""
    return cache_directory() / f"{robot.name}-{digest(robot, using)}.so"


def library_paths(robot: Robot) -> list[Path]:
    """Paths of the compiled kernels that this machine can use, the fastest first."""
    return list(dict.fromkeys(library_path(robot, using) for using in (vectors(), PORTABLE)))


def seal_path(path: Path) -> Path:
    """File with the library's hash."""
    return path.with_suffix(".sha256")


def is_intact(path: Path) -> bool:
    """Whether the library exists and has the hash of its seal."""
    try:
        return seal_path(path).read_bytes() == hashlib.sha256(path.read_bytes()).hexdigest().encode()
    except OSError:
        return False


def compiler() -> str | None:
    """The system's C compiler, or None."""
    return shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or shutil.which("clang")


def compile_kernel(robot: Robot, portable: bool = False) -> Path:
    """Compile a robot's functions, once however many threads and processes ask. Returns the path of the library.

    It is for this machine's processor, or, if `portable`, for every one of its kind, which takes twice as long to run.
    Raises RuntimeError if there is no compiler or it fails, OSError if the cache cannot be written.
    """
    count, flags = using = PORTABLE if portable else vectors()
    target = library_path(robot, using)
    target.parent.mkdir(parents=True, exist_ok=True)
    with (target.with_suffix(".lock")).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if is_intact(target):
            return target
        command = compiler()
        if command is None:
            raise RuntimeError("no C compiler found")
        with workplace(target) as folder:
            library, seal = folder / "kernel.so", folder / "kernel.sha256"
            code = folder / "kernel.c"
            code.write_text(_source(robot, count))
            run = subprocess.run(
                [command, *COMPILER_FLAGS, *flags, str(code), "-o", str(library), "-lm"], capture_output=True, text=True
            )
            if run.returncode:
                raise RuntimeError(f"the C compiler failed: {run.stderr[-500:]}")
            seal.write_text(hashlib.sha256(library.read_bytes()).hexdigest())
            # the seal first: a library without its seal counts as damaged, a seal without its library as absent
            seal.replace(seal_path(target))
            library.replace(target)
    _prune(target.parent)
    return target


@contextmanager
def workplace(target: Path) -> Iterator[Path]:
    """An empty folder beside a file of the cache, in which the holder of its lock makes it.

    A process that is killed leaves its folder behind: the next one that makes this file deletes it.
    """
    for left in target.parent.glob(f"{target.name}-*.part"):
        shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f"{target.name}-", suffix=".part") as folder:
        yield Path(folder)


def mark_used(path: Path) -> None:
    """Note that a library is in use: of many, those that rested longest are deleted."""
    with suppress(OSError):  # a cache that is read-only is not pruned either
        os.utime(path)


def _prune(folder: Path) -> None:
    """Delete the libraries that rested longest, so that MOST_LIBRARIES are left. Who has loaded one keeps it."""
    with suppress(OSError):
        libraries = sorted(folder.glob("*.so"), key=lambda each: each.stat().st_mtime, reverse=True)
        for library in libraries[MOST_LIBRARIES:]:
            for file in (library, seal_path(library), library.with_suffix(".lock")):
                file.unlink(missing_ok=True)


def _source(robot: Robot, count: int) -> str:
    """The functions of a robot as C, of so many nodes at once; their expressions are freed before the lock is."""
    with SYMBOLICS:
        return source(build(robot), count)
