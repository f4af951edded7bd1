"""Many problems at a time: by processes of this machine, by any executor, by a Dask cluster."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace

import pytest

from joulepath import DurationTooShort, Problem, optimize, optimize_many
from joulepath.optimizer.optimize_many import OPTIMIZE_MANY
from tests.optimizer.moves import AMPLE, problem, random_moves

MOVES = [problem(start, goal, deadline=AMPLE) for start, goal in random_moves(seed=0, count=3)]
TOO_FAST = replace(MOVES[0], duration_max=0.01)


def test_processes_give_what_one_call_gives() -> None:
    asked = [*MOVES, TOO_FAST]
    found = {each.index: each for each in optimize_many(asked, workers=2)}
    assert sorted(found) == [0, 1, 2, 3]
    for index, move in enumerate(MOVES):
        own = optimize(move)
        assert found[index].result().energy.electrical.total == own.energy.electrical.total, (
            "to the last bit"
        )
    with pytest.raises(DurationTooShort) as refusal:
        found[3].result()
    assert refusal.value.shortest > 0.01, "the error keeps its data"


def test_problems_are_taken_as_they_are_needed() -> None:
    taken = itertools.count()

    def endless() -> Iterator[Problem]:
        while True:
            next(taken)
            yield TOO_FAST

    with ThreadPoolExecutor(2) as threads:
        found = optimize_many(endless(), threads)
        several = list(itertools.islice(found, 5))
        found.close()
    assert all(isinstance(each.error, DurationTooShort) for each in several)
    assert next(taken) <= OPTIMIZE_MANY.ahead + 5


class _Client:
    """The subset of a Dask client used by the library."""

    def get_executor(self) -> Executor:
        return _AtOnce()


class _AtOnce(Executor):
    def submit(self, fn, /, *args, **kwargs):  # type: ignore[no-untyped-def]
        future: Future[object] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def test_a_client_is_used() -> None:
    (found,) = optimize_many([TOO_FAST], _Client())
    assert isinstance(found.error, DurationTooShort)


@pytest.mark.long
def test_a_dask_cluster() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        found = sorted(optimize_many(MOVES, client), key=lambda each: each.index)
    for each, move in zip(found, MOVES, strict=True):
        assert each.result().energy.electrical.total == optimize(move).energy.electrical.total
