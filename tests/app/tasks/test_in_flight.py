"""Equal requests at the same time: one computes, the others wait for it."""

from __future__ import annotations

import asyncio

import pytest

from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.queue import Busy
from joulepath.app.store.cache import Asked
from joulepath.app.tasks.answer_cache import InFlight
from joulepath.optimizer.exceptions import OutsideLimits

ASKED = Asked("key", 10.0)


class Bench:
    """Requests computed at the test's command."""

    def __init__(self) -> None:
        self.in_flight, self.free = InFlight(), asyncio.Event()
        self.begun = 0
        self.stopped = 0
        self.errors: list[Exception] = []

    def ask(self, asked: Asked = ASKED) -> asyncio.Task[tuple[TaskResult, bool]]:
        return asyncio.create_task(self.in_flight.result(asked, self._compute))

    async def _compute(self, left: float) -> TaskResult:
        assert left <= 10.0
        self.begun += 1
        number = self.begun
        try:
            await self.free.wait()
        except asyncio.CancelledError:
            self.stopped += 1
            raise
        if self.errors:
            raise self.errors.pop()
        return TaskResult(b"%d" % number, "text/plain")


@pytest.fixture
def bench() -> Bench:
    return Bench()


async def some_turns() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def test_equal_ones_are_computed_once(bench: Bench) -> None:
    asked = [
        bench.ask(),
        bench.ask(),
        bench.ask(),
        bench.ask(Asked("key", 9.0)),
        bench.ask(Asked("other", 10.0)),
    ]
    await some_turns()
    assert bench.begun == 3
    bench.free.set()
    found = [(result.document, is_anothers) for result, is_anothers in await asyncio.gather(*asked)]
    assert found == [(b"1", False), (b"1", True), (b"1", True), (b"2", False), (b"3", False)]
    assert (await bench.ask())[0].document == b"4", "later ones find it in the database"


async def test_it_goes_on_while_somebody_waits(bench: Bench) -> None:
    first, second = bench.ask(), bench.ask()
    await some_turns()
    first.cancel()
    await some_turns()
    assert (bench.begun, bench.stopped) == (1, 0)
    second.cancel()
    third = bench.ask()
    await some_turns()
    assert (bench.begun, bench.stopped) == (2, 1), "what is being stopped answers nobody"
    bench.free.set()
    assert (await third)[0].document == b"2"


async def test_what_the_service_is_to_blame_for_is_tried_again(bench: Bench) -> None:
    bench.errors = [Busy()]
    bench.free.set()
    first, second = bench.ask(), bench.ask()
    with pytest.raises(Busy):
        await first
    assert (await second)[0].document == b"2"
    bench.errors = [OutsideLimits("start", 1, 9.0, -1.0, 1.0)]
    wrong = [bench.ask(), bench.ask()]
    for each in wrong:
        with pytest.raises(OutsideLimits):
            await each
    assert bench.begun == 3
