"""Public entry point: `optimize_many(problems)` solves many problems in parallel."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import dataclass
from itertools import islice
from queue import SimpleQueue
from typing import Protocol

from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.declared_types import check_type
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.scalars import check_number
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class OptimizeManySettings:
    """Settings of `optimize_many`."""

    ahead: int = 64
    """Problems submitted ahead of time; limits the memory for any number of problems."""


OPTIMIZE_MANY = OptimizeManySettings()


class DaskClient(Protocol):
    """A client of a Dask cluster: `distributed.Client`."""

    def get_executor(self) -> Executor:
        """The cluster as an executor of `concurrent.futures`."""


@dataclass(frozen=True, eq=False)
class Optimized:
    """Outcome of the problem at `index`: its solution, or the error."""

    index: int
    solution: Solution | None
    error: JoulepathError | None

    def result(self) -> Solution:
        """The solution. Raises the error if there is none."""
        if self.solution is None:
            assert self.error is not None
            raise self.error
        return self.solution


def optimize_many(
    problems: Iterable[Problem],
    client: DaskClient | Executor | None = None,
    workers: int | None = None,
) -> Iterator[Optimized]:
    """Solve many problems in parallel, each by `optimize`.

    Problems are taken from the iterable as needed. If the iteration ends early, waiting problems
    are not solved. The worker processes import the main module of a script, which therefore needs
    `if __name__ == "__main__":`.

    Args:
        problems: problems to solve.
        client: Dask client or an executor of `concurrent.futures`; None for processes of this
            machine.
        workers: number of these processes; None for one per CPU.

    Yields:
        The outcome of every problem, in any order.

    Raises:
        InvalidProblem: `problems` is no iterable, or `workers` no positive number.
        BrokenProcessPool: a process died.
    """
    check_type("problems", problems, Iterable)
    check_number("workers", workers, least=1, optional=True)
    if client is not None:
        yield from _solved_by(
            client if isinstance(client, Executor) else client.get_executor(), problems
        )
        return
    # forked processes would share the threads of libraries
    own = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))
    try:
        yield from _solved_by(own, problems)
    finally:
        own.shutdown(wait=False, cancel_futures=True)


def _solved_by(executor: Executor, problems: Iterable[Problem]) -> Iterator[Optimized]:
    waiting, done = enumerate(problems), SimpleQueue[Future[Optimized]]()
    open_ = set[Future[Optimized]]()
    try:
        while True:
            for index, problem in islice(waiting, OPTIMIZE_MANY.ahead - len(open_)):
                future = executor.submit(_solved, index, problem)
                open_.add(future)
                future.add_done_callback(done.put)
            if not open_:
                return
            ended = done.get()
            open_.discard(ended)
            yield ended.result()
    finally:
        for future in open_:
            future.cancel()


def _solved(index: int, problem: Problem) -> Optimized:
    try:
        return Optimized(index, optimize(problem, progress=False), None)
    except JoulepathError as error:
        return Optimized(index, None, error)
