"""Per-node functions for a fixed number of nodes, evaluated by CasADi's virtual machine or by a
compiled library.
"""

from __future__ import annotations

import _ctypes
import ctypes
import weakref
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import casadi as ca
import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_expressions import SYMBOLICS, sizes


class KernelEvaluation:
    """A function of a fixed number of nodes, with its own memory, for use by one thread.

    The function reads its arguments from numpy arrays and writes its results into others, without
    copies or conversions.
    """

    arguments: list[Array]
    results: list[Array]
    run: Callable[[], object]

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluates the function. The next call overwrites the results.

        Args:
            arguments: one array per argument. Row k belongs to node k; all nodes share the last
                argument.
        """
        for own, given in zip(self.arguments, arguments, strict=True):
            own[...] = given
        self.run()
        return self.results


class Functions(Protocol):
    """Evaluator of the functions of `kernel_expressions`."""

    compiled: bool

    def evaluation(self, name: str, count: int) -> KernelEvaluation:
        """Evaluation of the function `name` of `count` nodes, for the calling thread."""
        ...


class Interpreted:
    """Functions evaluated by CasADi's virtual machine."""

    compiled = False

    def __init__(self, functions: list[ca.Function]) -> None:
        self._functions = {each.name(): each for each in functions}
        self._mapped: dict[tuple[str, int], ca.Function] = {}

    def evaluation(self, name: str, count: int) -> KernelEvaluation:
        """Evaluation of a function, see `Functions`."""
        key = (name, count)
        with SYMBOLICS:
            if key not in self._mapped:
                self._mapped[key] = self._functions[name].map(count)
            return _Mapped(self._mapped[key])


class Compiled:
    """Functions of an arm of nq joints, in a library compiled from `kernel_source`.

    The library is unloaded when neither this object nor any of its evaluations is referenced.

    Raises:
        OSError: the library cannot be loaded.
    """

    compiled = True

    def __init__(self, path: Path, nq: int) -> None:
        self._library, self._nq = ctypes.CDLL(str(path)), nq
        # ctypes never unloads a library, and users may bring any number of arms. At the end of the
        # process another thread may still use the library, so it is not unloaded then.
        weakref.finalize(self, _ctypes.dlclose, self._library._handle).atexit = False

    def evaluation(self, name: str, count: int) -> KernelEvaluation:
        """Evaluation of a function, see `Functions`."""
        return _Called(self, getattr(self._library, name), *sizes(self._nq)[name], count)


class _Mapped(KernelEvaluation):
    """CasADi function mapped over the nodes."""

    def __init__(self, mapped: ca.Function) -> None:
        self._buffer: Any
        self._buffer, self.run = mapped.buffer()
        self.arguments = [np.zeros(mapped.size_in(i)[::-1]) for i in range(mapped.n_in())]
        self.results = [np.zeros(mapped.size_out(i)[::-1]) for i in range(mapped.n_out())]
        for i, array in enumerate(self.arguments):
            self._buffer.set_arg(i, array.data)
        for i, array in enumerate(self.results):
            self._buffer.set_res(i, array.data)


class _Called(KernelEvaluation):
    """Library function with its own loop over the nodes; it keeps the library loaded."""

    def __init__(
        self,
        library: Compiled,
        function: Callable[..., object],
        given: tuple[int, ...],
        found: tuple[int, ...],
        count: int,
    ) -> None:
        self._library = library
        *own, shared = given
        self.arguments = [*(np.zeros((count, size)) for size in own), np.zeros(shared)]
        self.results = [np.zeros((count, size)) for size in found]
        self.run = partial(
            function, ctypes.c_long(count), _addresses(self.arguments), _addresses(self.results)
        )


def _addresses(arrays: list[Array]) -> ctypes.Array[ctypes.c_void_p]:
    return (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
