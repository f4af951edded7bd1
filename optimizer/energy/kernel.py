"""The per-node functions of the programme: built once per robot, compiled, and cached on disk.

`node` gives cost, motor torque and their first and second derivatives at one instant of a motion; everything that a
request may change (payload, gravity, drives, friction, objective) is a parameter. The functions are compiled by the
system's C compiler once and kept under `JOULEPATH_CACHE_DIR` (default `~/.cache/joulepath`), named by a digest of all
that they depend on. Until the compiled file is there, or where there is no compiler, CasADi's virtual machine
evaluates the same expressions.

`python -m optimizer.energy.precompile` compiles the kernels of all robots.
"""

from __future__ import annotations

import threading
from functools import cache

import casadi as ca
import numpy as np

from models.robot import Array, Robot
from optimizer.energy.kernel_cache import compile_kernel, compiler, is_intact, library_path, log, seal_path
from optimizer.energy.kernel_expressions import FUNCTION_NAMES, build

# nodes evaluated by one call where the caller's number varies
CHUNK = 64


class _Mapped:
    """A function mapped over a fixed number of nodes, called on numpy buffers without copies or conversions."""

    def __init__(self, function: ca.Function, count: int) -> None:
        self._function = function.map(count)
        self._buffer, self._run = self._function.buffer()
        self.arguments = [np.zeros(self._function.size_in(i)[::-1]) for i in range(self._function.n_in())]
        self.results = [np.zeros(self._function.size_out(i)[::-1]) for i in range(self._function.n_out())]
        for i, array in enumerate(self.arguments):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore[call-arg, arg-type]
        for i, array in enumerate(self.results):
            self._buffer.set_res(i, memoryview(array))  # type: ignore[call-arg, arg-type]

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluate; row k of every argument belongs to node k. The results are overwritten by the next call."""
        for own, given in zip(self.arguments, arguments, strict=True):
            own[...] = given
        self._run()
        return self.results


class Kernel:
    """A robot's functions, ready to be called on arrays of nodes. Not for several threads at once."""

    def __init__(self, robot: Robot, functions: list[ca.Function], compiled: bool) -> None:
        self.nq = robot.nq
        self.compiled = compiled
        self._functions = dict(zip(FUNCTION_NAMES, functions, strict=True))
        self._mapped: dict[tuple[str, int], _Mapped] = {}

    def _map(self, name: str, count: int) -> _Mapped:
        key = (name, count)
        if key not in self._mapped:
            self._mapped[key] = _Mapped(self._functions[name], count)
        return self._mapped[key]

    def node(self, y: Array, multiplier: Array, weight: Array, p: Array) -> tuple[Array, ...]:
        """Cost (N,), tau_motor (N, nq), gradient (N, 3nq), Jacobian (N, nq, 3nq), Hessian (N, 3nq, 3nq).

        y (N, 3nq), multiplier (N, nq), weight (N,), p packed `Parameters`. Views that the next call overwrites.
        """
        count, nq = len(y), self.nq
        cost, tau, gradient, jacobian, hessian = self._map("node", count)(y, multiplier, weight[:, None], p)
        return (
            cost[:, 0],
            tau,
            gradient,
            jacobian.reshape(count, 3 * nq, nq).transpose(0, 2, 1),
            hessian.reshape(count, 3 * nq, 3 * nq),
        )

    def value(self, y: Array, p: Array) -> tuple[Array, Array]:
        """Cost (N,) and tau_motor (N, nq). Views that the next call overwrites."""
        cost, tau = self._map("value", len(y))(y, p)
        return cost[:, 0], tau

    def torque(self, q: Array, v: Array, a: Array, p: Array) -> Array:
        """Rigid body and rotor torque tau (k, nq) for any number of samples."""
        count = len(q)
        mapped = self._map("torque", CHUNK)
        y = np.zeros((-(-count // CHUNK) * CHUNK, 3 * self.nq))
        y[:count] = np.hstack([q, v, a])
        return np.concatenate([mapped(y[i : i + CHUNK], p)[0].copy() for i in range(0, len(y), CHUNK)])[:count]


class _Loader:
    """Holds a robot's kernel and swaps the compiled one in when it is there."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.library_path = library_path(robot)
        self._kernel: Kernel | None = None
        self._compiling: threading.Thread | None = None

    def get(self) -> Kernel:
        if self._kernel is not None and (self._kernel.compiled or not seal_path(self.library_path).exists()):
            return self._kernel
        if is_intact(self.library_path):
            functions = [ca.external(name, str(self.library_path)) for name in FUNCTION_NAMES]
            self._kernel = Kernel(self._robot, functions, compiled=True)
        elif self._kernel is None:
            self._kernel = Kernel(self._robot, build(self._robot), compiled=False)
        if not self._kernel.compiled and self._compiling is None and compiler() is not None:
            self._compiling = threading.Thread(target=self._compile, name="kernel-compiler", daemon=True)
            self._compiling.start()
        return self._kernel

    def _compile(self) -> None:
        try:
            compile_kernel(self._robot)
        except (RuntimeError, OSError) as error:
            log.warning("kernel of %s not compiled, the virtual machine serves: %s", self._robot.name, error)


@cache
def _loader(robot: Robot) -> _Loader:
    return _Loader(robot)


def kernel_for(robot: Robot) -> Kernel:
    """The kernel of a robot: compiled if the cache has it, else interpreted while the compiler runs."""
    return _loader(robot).get()
