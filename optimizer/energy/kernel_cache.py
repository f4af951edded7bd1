"""Compiled kernels on disk: compiled once by the system's C compiler, named by a digest of all they depend on."""

from __future__ import annotations

import fcntl
import hashlib
import logging
import os
import shutil
import subprocess
import tempfile
from importlib.metadata import version
from pathlib import Path

import casadi as ca
import numpy as np

import models.robot
from models.robot import Robot
from optimizer.energy import inverse_dynamics, kernel_expressions, losses
from optimizer.energy.kernel_expressions import build

log = logging.getLogger(__name__)

COMPILER_FLAGS = ("-O2", "-fPIC", "-shared", "-fno-math-errno")


def cache_directory() -> Path:
    """Where compiled kernels are kept."""
    given = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(given) if given else Path.home() / ".cache" / "joulepath"


def digest(robot: Robot) -> str:
    """Hash of everything that the compiled functions depend on: the chain, the sources, versions, compiler flags."""
    h = hashlib.sha256()
    for module in (models.robot, inverse_dynamics, losses, kernel_expressions):
        h.update(Path(str(module.__file__)).read_bytes())
    h.update(Path(__file__).read_bytes())
    h.update(repr((version("casadi"), COMPILER_FLAGS, os.uname().machine)).encode())
    flange = robot.model.frames[robot.model.getFrameId("flange")].placement
    figures = [placement.homogeneous for placement in [*robot.model.jointPlacements, flange]]
    figures += [body.toDynamicParameters() for body in robot.model.inertias]
    for figure in figures:
        # rounded, since the last digit of a sine differs between processors; + 0.0 makes -0.0 and 0.0 one
        h.update((np.round(figure, 12) + 0.0).tobytes())
    return h.hexdigest()[:24]


def library_path(robot: Robot) -> Path:
    """Path of a robot's compiled kernel."""
    return cache_directory() / f"{robot.name}-{digest(robot)}.so"


def seal_path(path: Path) -> Path:
    """File that holds the library's own hash, so that a damaged library is noticed before it is loaded."""
    return path.with_suffix(".sha256")


def is_intact(path: Path) -> bool:
    """Whether the library is there and is the one that was sealed."""
    try:
        return seal_path(path).read_bytes() == hashlib.sha256(path.read_bytes()).hexdigest().encode()
    except OSError:
        return False


def compiler() -> str | None:
    """The system's C compiler, or None."""
    return shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or shutil.which("clang")


def compile_kernel(robot: Robot) -> Path:
    """Compile a robot's functions into the cache, once however many processes ask; returns the library.

    Raises RuntimeError where there is no compiler or it fails, OSError where the cache cannot be written.
    """
    target = library_path(robot)
    target.parent.mkdir(parents=True, exist_ok=True)
    with (target.with_suffix(".lock")).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if is_intact(target):
            return target
        command = compiler()
        if command is None:
            raise RuntimeError("no C compiler found")
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            generator = ca.CodeGenerator("kernel.c", {"with_header": False})
            for function in build(robot):
                generator.add(function)
            generator.generate(folder + "/")
            library = Path(folder) / "kernel.so"
            source = str(Path(folder) / "kernel.c")
            run = subprocess.run(
                [command, *COMPILER_FLAGS, source, "-o", str(library), "-lm"], capture_output=True, text=True
            )
            if run.returncode:
                raise RuntimeError(f"the C compiler failed: {run.stderr[-500:]}")
            seal = Path(folder) / "kernel.sha256"
            seal.write_text(hashlib.sha256(library.read_bytes()).hexdigest())
            # the seal first: a library without its seal counts as damaged, a seal without its library as absent
            seal.replace(seal_path(target))
            library.replace(target)
    return target
