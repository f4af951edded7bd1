"""Per-node functions of the NLP, compiled once per robot and callable from any thread.

`node` gives cost, limited torque and their first and second derivatives at one instant of a motion.
Everything that a request may change (payload, gravity, drives, friction, objective) is a parameter.
The system's C compiler compiles the functions, and `kernel_cache` stores them on disk. Until the
library exists, or without a compiler, CasADi's virtual machine evaluates the same expressions.

`python -m joulepath.optimizer.dynamics.precompile` compiles the kernels of all or of named robots.
"""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from joulepath.models.robot import MOST_ROBOTS, Array, Robot
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel, library_paths
from joulepath.optimizer.dynamics.kernel_expressions import build
from joulepath.optimizer.dynamics.kernel_functions import (
    Compiled,
    Functions,
    Interpreted,
    KernelEvaluation,
)
from joulepath.optimizer.native.build import compiler
from joulepath.optimizer.native.library_cache import is_intact, mark_used, seal_path

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class KernelSettings:
    """Division of evaluations of any number of samples."""

    chunk_nodes: int = 64
    """Nodes per call of a compiled function."""
    chunks_per_check: int = 128
    """Chunks between two checks of the deadline, about ten milliseconds."""


KERNEL = KernelSettings()


class _Evaluations(threading.local):
    """The calling thread's evaluations by function and number of nodes, freed when the thread
    ends.
    """

    def __init__(self) -> None:
        self.known: dict[tuple[str, int], KernelEvaluation] = {}


class Kernel:
    """Functions of a robot on arrays of nodes. Any number of threads may call one kernel at the
    same time.

    The functions run without Python's global lock, so every thread has its own memory for arguments
    and results.
    """

    def __init__(self, robot: Robot, functions: Functions) -> None:
        self.nq = robot.nq
        self.compiled = functions.compiled
        self._functions = functions
        self._evaluations = _Evaluations()

    def _evaluation(self, name: str, count: int) -> KernelEvaluation:
        known, key = self._evaluations.known, (name, count)
        if key not in known:
            known[key] = self._functions.evaluation(name, count)
        return known[key]

    def node(self, y: Array, multiplier: Array, weight: Array, p: Array) -> tuple[Array, ...]:
        """Cost and limited torque with their derivatives at N nodes.

        Args:
            y: states (N, 3nq) = q, v, a.
            multiplier: weights (N, nq) of the limited torques in the Hessian.
            weight: weights (N,) of the cost in the Hessian.
            p: packed `Parameters`.

        Returns:
            Cost (N,), tau_limited (N, nq), gradient (N, 3nq), Jacobian (N, nq, 3nq) and Hessian (N,
            3nq, 3nq). They are views, overwritten by the thread's next call with the same number of
            nodes.
        """
        count, nq = len(y), self.nq
        cost, tau, gradient, jacobian, hessian = self._evaluation("node", count)(
            y, multiplier, weight[:, None], p
        )
        return (
            cost[:, 0],
            tau,
            gradient,
            jacobian.reshape(count, 3 * nq, nq).transpose(0, 2, 1),
            hessian.reshape(count, 3 * nq, 3 * nq),
        )

    def value(self, y: Array, p: Array) -> tuple[Array, Array]:
        """Cost (N,) and tau_limited (N, nq) [N·m]: views, overwritten by the thread's next call
        with the same number of nodes.
        """
        cost, tau = self._evaluation("value", len(y))(y, p)
        return cost[:, 0], tau

    def values(self, y: Array, p: Array) -> tuple[Array, Array]:
        """Cost (k,) and tau_limited (k, nq) [N·m] for any number of samples y (k, 3nq)."""
        cost, tau = self._in_chunks("value", y, p, (1, self.nq))
        return cost[:, 0], tau

    def torque(self, q: Array, v: Array, a: Array, p: Array) -> Array:
        """Rigid-body and rotor torques tau (k, nq) [N·m] for any number of samples."""
        (tau,) = self._in_chunks("torque", np.hstack([q, v, a]), p, (self.nq,))
        return tau

    def _in_chunks(self, name: str, samples: Array, p: Array, sizes: Sequence[int]) -> list[Array]:
        """Results (k, size) of a function of (y, p) for any number of samples y (k, 3nq)."""
        count, chunk = len(samples), KERNEL.chunk_nodes
        evaluation = self._evaluation(name, chunk)
        y = np.zeros((-(-count // chunk) * chunk, 3 * self.nq))
        y[:count] = samples
        results = [np.empty((len(y), size)) for size in sizes]
        for k, i in enumerate(range(0, len(y), chunk)):
            if k % KERNEL.chunks_per_check == KERNEL.chunks_per_check - 1:
                checkpoint()
            for result, value in zip(results, evaluation(y[i : i + chunk], p), strict=True):
                result[i : i + chunk] = value
        return [result[:count] for result in results]


class _Loader:
    """Loader of a robot's kernel, for any number of threads: the compiled kernel as soon as the
    library exists, else the interpreted one.

    The interpreted kernel stays referenced after the compiled one has replaced it: other threads
    may still use it, and expressions may only be freed under `SYMBOLICS`.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.paths = library_paths(robot)
        self._lock = threading.Lock()
        self._compiled: Kernel | None = None
        self._interpreted: Kernel | None = None
        self._compiling: threading.Thread | None = None

    def get(self) -> Kernel:
        # Read once, since other threads may set it meanwhile.
        compiled = self._compiled
        if compiled is not None:
            return compiled
        with self._lock:
            return self._compiled or self._load()

    def _load(self) -> Kernel:
        # `Path.exists` raises an error in a folder that this user may not search.
        is_sealed = any(os.access(seal_path(path), os.F_OK) for path in self.paths)
        if self._interpreted is not None and not is_sealed:
            return self._interpreted
        path = next(filter(is_intact, self.paths), None)
        if path is not None:
            mark_used(path)
            self._compiled = Kernel(self._robot, Compiled(path, self._robot.nq))
            return self._compiled
        if self._interpreted is None:
            self._interpreted = Kernel(self._robot, Interpreted(build(self._robot)))
        if self._compiling is None and compiler() is not None:
            self._compiling = threading.Thread(
                target=self._compile, name="kernel-compiler", daemon=True
            )
            self._compiling.start()
        return self._interpreted

    def _compile(self) -> None:
        try:
            compile_kernel(self._robot)
        except (RuntimeError, OSError) as error:
            log.warning(
                "the kernel of %s was not compiled, so CasADi interprets it: %s",
                self._robot.name,
                error,
            )


_LOADERS = threading.Lock()


@lru_cache(MOST_ROBOTS)
def _loader(robot: Robot) -> _Loader:
    return _Loader(robot)


def kernel_for(robot: Robot) -> Kernel:
    """Kernel of a robot: compiled if the library is on disk, else interpreted while the compiler
    runs.
    """
    # Two threads that miss the cache at the same time would both build a loader, but only one may
    # compile.
    with _LOADERS:
        loader = _loader(robot)
    return loader.get()
