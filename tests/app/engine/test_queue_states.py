"""The queue under any order of events loses no worker and lets no request wait beside an idle one.

Events come in the same turn of the event loop or in different turns. Only a step moves the clock.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from joulepath.app.engine import fair_queue
from joulepath.app.engine.fair_queue import PATIENCE, FairQueue, Place, State
from joulepath.app.exceptions.queue import Busy

CAPACITY = 8
SHARE = 5
CLIENTS = st.sampled_from("abc")
WORKERS = 3
# An abandoned request needs three turns: to leave, to give its worker back, and for the next
# request to get the worker.
SETTLING_TURNS = 20
STEPS_OF_ONE_RUN = 100


class StubWorker:
    """A worker whose task ends at the test's command, or at once when told to stop."""

    def __init__(self) -> None:
        self.alive = True
        self.task: str | None = None
        self.stopped = False
        self._calls: list[Callable[[], object]] = []

    @property
    def is_free(self) -> bool:
        return self.task is None

    def when_free(self, call: Callable[[], object]) -> None:
        if self.is_free:
            call()
        else:
            self._calls.append(call)

    def begin(self, name: str) -> None:
        assert self.alive and self.is_free, "a worker that has ended, or is at a task, was lent"
        self.task, self.stopped = name, False

    def end(self) -> None:
        self.task = None
        calls, self._calls = self._calls, []
        for call in calls:
            call()

    def die(self) -> None:
        self.alive = False
        self.end()


class Request:
    """A request, from its arrival to its answer, as the engine has it."""

    def __init__(self, queue: FairQueue, client: str, name: str, limit: float) -> None:
        self.client, self.name = client, name
        self.place: Place | None = None
        self.worker: StubWorker | None = None
        self.over = asyncio.Event()
        """Its task has ended, was stopped, or its worker has died."""
        self.given_back = False
        self.running = asyncio.create_task(self._run(queue, limit))

    async def _run(self, queue: FairQueue, limit: float) -> str:
        with queue.place(self.client) as self.place:
            async with asyncio.timeout(limit):
                while True:
                    async with queue.worker(self.place) as worker:
                        if not worker.alive:  # it has died since it was lent
                            continue
                        self.worker = worker
                        worker.begin(self.name)
                        self.over.clear()
                        self.given_back = False
                        if not self.place.gave_back:
                            self.place.give_back = self.stop
                        try:
                            await self.over.wait()
                        finally:
                            self.worker, worker.stopped = None, True
                        if not self.given_back:
                            return self.name
                    self.place.begins_again = True

    def stop(self) -> None:
        """Has the task end, because another client needs the worker."""
        self.given_back = True
        assert self.worker is not None
        self.worker.stopped = True


class SpareWork:
    """Work that can wait, on a worker needed by no request."""

    def __init__(self, queue: FairQueue) -> None:
        self.worker: StubWorker | None = None
        self.over = asyncio.Event()
        self.running = asyncio.create_task(self._run(queue))

    async def _run(self, queue: FairQueue) -> None:
        async with queue.spare() as worker:
            self.worker = worker
            worker.begin("spare")
            try:
                await self.over.wait()
            finally:
                self.worker, worker.stopped = None, True


class StillLoop(asyncio.SelectorEventLoop):
    """An event loop with a clock moved by the steps alone."""

    now = 0.0

    def time(self) -> float:
        return self.now


class QueueMachine(RuleBasedStateMachine):
    """Requests arrive, leave, time out and finish; workers die; spare work comes and goes; workers
    are given back.
    """

    def __init__(self) -> None:
        super().__init__()
        self.loop = StillLoop()
        self.loop.set_exception_handler(self._noticed)
        self.noticed: list[dict[str, Any]] = []
        self.requests: list[Request] = []
        self.spares: list[SpareWork] = []
        self.workers: list[StubWorker] = []
        self.count = 0
        self.loop.run_until_complete(self._begin())

    async def _begin(self) -> None:
        self.queue: FairQueue = fair_queue.FairQueue(CAPACITY, SHARE)
        for _ in range(WORKERS - 1):
            self._new_worker()

    def _noticed(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        self.noticed.append(context)

    def _within(self, call: Callable[[], Any]) -> Any:
        """The result of a call within the loop, without another turn of the loop."""

        async def within() -> Any:
            return call()

        step = within()
        asyncio._set_running_loop(self.loop)
        try:
            step.send(None)
        except StopIteration as ended:
            return ended.value
        finally:
            asyncio._set_running_loop(None)

    def _turn(self) -> None:
        self.loop.call_soon(self.loop.stop)
        self.loop.run_forever()

    def _new_worker(self) -> None:
        worker = StubWorker()
        self.workers.append(worker)
        self.queue.put(worker)

    @property
    def busy(self) -> list[StubWorker]:
        return [worker for worker in self.workers if worker.task is not None]

    @rule(client=CLIENTS, limit=st.sampled_from([0.5, 3.0, 1e6]))
    def arrives(self, client: str, limit: float) -> None:
        self.count += 1
        self.requests.append(
            self._within(lambda: Request(self.queue, client, f"{client}{self.count}", limit))
        )

    @precondition(lambda self: self.requests)
    @rule(data=st.data())
    def leaves(self, data: st.DataObject) -> None:
        data.draw(st.sampled_from(self.requests)).running.cancel()

    @precondition(lambda self: self.busy)
    @rule(data=st.data())
    def task_ends(self, data: st.DataObject) -> None:
        """The task is done, or its worker has ended it after a stop."""
        worker = data.draw(st.sampled_from(self.busy))
        self._within(lambda: self._end(worker, worker.end))

    @precondition(lambda self: any(worker.alive for worker in self.workers))
    @rule(data=st.data())
    def worker_dies(self, data: st.DataObject) -> None:
        worker = data.draw(st.sampled_from([worker for worker in self.workers if worker.alive]))
        self._within(lambda: self._end(worker, worker.die))

    def _end(self, worker: StubWorker, how: Callable[[], None]) -> None:
        how()
        for each in (*self.requests, *self.spares):
            if each.worker is worker:
                each.over.set()

    @precondition(lambda self: len([worker for worker in self.workers if worker.alive]) < WORKERS)
    @rule()
    def worker_comes(self) -> None:
        for worker in [worker for worker in self.workers if not worker.alive]:
            self.queue.remove(worker)
            self.workers.remove(worker)
        self._within(self._new_worker)

    @precondition(lambda self: len(self.spares) < 2)
    @rule()
    def spare_work_comes(self) -> None:
        self.spares.append(self._within(lambda: SpareWork(self.queue)))

    @precondition(lambda self: self.spares)
    @rule(data=st.data())
    def spare_work_leaves(self, data: st.DataObject) -> None:
        data.draw(st.sampled_from(self.spares)).running.cancel()

    @rule()
    def turn(self) -> None:
        self._turn()

    @rule(seconds=st.sampled_from([0.5, PATIENCE, 3.0]))
    def time_passes(self, seconds: float) -> None:
        self.loop.now += seconds
        self._turn()

    @rule()
    def settles(self) -> None:
        for _ in range(SETTLING_TURNS):
            self._turn()
        self._has_settled()

    def _has_settled(self) -> None:
        """Invariants of the queue at rest."""
        alive = [worker for worker in self.workers if worker.alive]
        idle = [worker for worker in alive if worker.is_free]
        assert {worker for worker, loan in self.queue._loans.items() if worker.alive} == set(alive)
        assert {worker for worker in alive if self.queue._loans[worker] is None} == set(idle), (
            "a worker is lent to nobody"
        )
        waiting = [
            each
            for each in self.requests
            if each.place is not None and each.place.state is State.WAITING
        ]
        assert not (waiting and idle), "a request waits while a worker is idle"
        assert self.queue.someone_waits == bool(waiting)
        assert self.queue.is_stuck == (bool(waiting) and not alive)
        has = Counter(each.client for each in self.requests if not each.running.done())
        assert self.queue._places == has, "a place is counted that is over"

    @invariant()
    def nobody_is_confused(self) -> None:
        assert not self.noticed, self.noticed
        for request in [each for each in self.requests if each.running.done()]:
            self.requests.remove(request)
            if request.running.cancelled():
                continue
            error = request.running.exception()
            assert error is None or isinstance(error, Busy | TimeoutError), (
                f"{request.name} got {error!r}"
            )
            if error is None:
                assert request.running.result() == request.name
        for spare in [each for each in self.spares if each.running.done()]:
            self.spares.remove(spare)
            assert spare.running.cancelled() or spare.running.exception() is None

    def teardown(self) -> None:
        for each in (*self.requests, *self.spares):
            each.running.cancel()
        try:
            for worker in self.busy:
                self._within(lambda worker=worker: self._end(worker, worker.end))
            self.settles()
            for worker in self.busy:
                self._within(lambda worker=worker: self._end(worker, worker.end))
            self.settles()
            self.nobody_is_confused()
            assert not self.requests and not self.spares and not self.queue._places
            assert all(loan is None for worker, loan in self.queue._loans.items() if worker.alive)
        finally:
            self.loop.close()


def test_a_request_that_gave_its_worker_back_waits_beside_no_idle_one() -> None:
    """The other worker serves the same client all the time."""
    machine = QueueMachine()
    for client in "aab":
        machine.arrives(client, 1e6)
        machine.settles()
    machine.time_passes(PATIENCE)
    for task in ("a2", "b3"):
        (worker,) = [each for each in machine.busy if each.task == task]
        machine._within(lambda worker=worker: machine._end(worker, worker.end))
        machine.settles()
    assert {each.task for each in machine.busy} == {"a1", "a2"}
    machine.teardown()


def run_machine(steps: int) -> None:
    run_state_machine_as_test(
        QueueMachine,
        settings=settings(
            max_examples=steps // STEPS_OF_ONE_RUN,
            stateful_step_count=STEPS_OF_ONE_RUN,
            derandomize=True,
            database=None,
            deadline=None,
            suppress_health_check=list(HealthCheck),
            phases=[Phase.generate, Phase.shrink],
        ),
    )


def test_no_order_of_events_confuses_the_queue() -> None:
    run_machine(1_500)


@pytest.mark.long
def test_no_order_of_many_events_confuses_the_queue() -> None:
    run_machine(100_000)
