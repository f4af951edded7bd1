"""Turns of the event loop: what comes all at once passes a few at a time, and others get their turn in between."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from joulepath.app.http.turns import Turns

MOST = 3


def run(test: Callable[[Turns], Awaitable[None]]) -> None:
    async def in_loop() -> None:
        await test(Turns(MOST))

    asyncio.run(in_loop())


def test_few_pass_in_one_turn_in_the_order_in_which_they_came() -> None:
    async def test(turns: Turns) -> None:
        passed: list[int] = []
        in_turns: list[int] = []

        async def one(number: int) -> None:
            await turns.next()
            passed.append(number)

        tasks = [asyncio.create_task(one(number)) for number in range(10 * MOST)]
        while len(passed) < len(tasks):
            before = len(passed)
            await asyncio.sleep(0)  # the others, such as a request that is small
            in_turns.append(len(passed) - before)
        assert passed == list(range(10 * MOST))
        assert max(in_turns) == MOST

    run(test)


def test_who_leaves_takes_no_turn() -> None:
    async def test(turns: Turns) -> None:
        waiting = [asyncio.create_task(turns.next()) for _ in range(3 * MOST)]
        await asyncio.sleep(0)
        for task in waiting[MOST:-1]:
            task.cancel()
        async with asyncio.timeout(60):
            await waiting[-1]
        assert all(task.done() for task in waiting[:MOST])

    run(test)


def test_one_alone_never_waits() -> None:
    async def test(turns: Turns) -> None:
        for _ in range(5):
            for _ in range(MOST):
                waiting = turns.next()
                try:
                    waiting.send(None)
                except StopIteration:
                    continue
                raise AssertionError("it waited")
            for _ in range(2):
                await asyncio.sleep(0)

    run(test)
