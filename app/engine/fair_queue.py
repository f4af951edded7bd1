"""A fair queue: clients share the workers evenly, and one client cannot fill the queue."""

from __future__ import annotations

import asyncio
import time
from collections import Counter, deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from enum import Enum, auto

from joulepath.app.engine.worker import Worker
from joulepath.app.exceptions.queue import Busy, TooManyRequests

PATIENCE = 2.0
"""Time [s] a client without a worker waits before a client with several workers gives one back."""


class State(Enum):
    """State of a place."""

    IDLE = auto()
    """It does not wait: it has not begun to, or its request is over."""
    WAITING = auto()
    """It stands in the line of its client."""
    GRANTED = auto()
    """A worker is lent to it, and its request does not know yet."""
    WORKING = auto()
    """Its request has the worker."""
    YIELDING = auto()
    """Its request has the worker and must give it back."""


class Place:
    """A request's place in the queue, from its arrival to its answer."""

    def __init__(self, client: str) -> None:
        self.client = client
        self.state = State.IDLE
        self.since = 0.0
        """When it began to wait, by the monotonic clock [s]."""
        self.gave_back = False
        """Whether it had to give its worker back. As long as its client has another worker, it then
        comes after all other clients.
        """
        self.begins_again = False
        """Whether its worker was taken or has died. Then it comes before the others of its
        client."""
        self.give_back: Callable[[], object] | None = None
        """Has the task end soon. Set while it is in a worker and may be stopped."""
        self.granted: asyncio.Future[Loan] | None = None

    @property
    def waits(self) -> bool:
        """Whether a worker may be lent to the place: its request has neither left nor timed out."""
        return self.state is State.WAITING and self.granted is not None and not self.granted.done()


class Loan:
    """A worker lent to a place, or to deferrable work (None), until it is returned without a
    task."""

    def __init__(self, worker: Worker, place: Place | None) -> None:
        self.worker, self.place = worker, place
        self.counts = place is not None
        """Whether the worker counts as one of the client's workers."""


class FairQueue:
    """Lends workers to waiting places, first to the client with the fewest workers, then in turn.

    `capacity` is the largest number of requests in workers and in the queue, `share` that of one
    client.

    Every worker is a key of `_loans` from `put` until its end is noticed: its value is None while
    it is idle, its loan otherwise. A worker therefore always has exactly one state, and all counts
    are derived from these states.
    """

    def __init__(self, capacity: int, share: int) -> None:
        self._capacity, self._share = capacity, share
        self._places: Counter[str] = Counter()
        self._waiting: dict[str, deque[Place]] = {}
        self._loans: dict[Worker, Loan | None] = {}
        self._changed = asyncio.Event()

    @contextmanager
    def place(self, client: str) -> Iterator[Place]:
        """A place in the queue. Raises TooManyRequests or Busy."""
        if self._places[client] >= self._share:
            raise TooManyRequests
        if self._places.total() >= self._capacity:
            raise Busy
        self._places[client] += 1
        try:
            yield Place(client)
        finally:
            self._places[client] -= 1
            if not self._places[client]:  # names of clients must not pile up
                del self._places[client]

    @asynccontextmanager
    async def worker(self, place: Place) -> AsyncIterator[Worker]:
        """A worker, when it is the place's turn."""
        loan = await self._turn(place)
        place.state = State.WORKING
        try:
            yield loan.worker
        finally:
            place.state, place.give_back = State.IDLE, None
            self._return(loan)

    @asynccontextmanager
    async def spare(self) -> AsyncIterator[Worker]:
        """A worker not needed by any waiting place, as soon as there is one."""
        while self._next() is not None or (worker := self._idle_worker()) is None:
            self._changed.clear()
            await self._changed.wait()
        loan = self._lend(worker, None)
        try:
            yield worker
        finally:
            self._return(loan)

    @property
    def someone_waits(self) -> bool:
        """Whether a request waits for a worker. May be read in any thread."""
        return bool(self._waiting)

    @property
    def waiting(self) -> list[Place]:
        """Places waiting for a worker."""
        return [place for line in self._waiting.values() for place in line]

    @property
    def oldest(self) -> float:
        """Waiting time of the oldest waiting place [s]; 0 without one."""
        now = time.monotonic()
        return max((now - place.since for place in self.waiting), default=0.0)

    @property
    def busy(self) -> int:
        """Number of workers running a task."""
        return sum(loan is not None and loan.worker.alive for loan in self._loans.values())

    @property
    def is_stuck(self) -> bool:
        """Whether a request waits for a worker, and none is at work."""
        return any(place.waits for place in self.waiting) and not any(
            loan is not None and loan.worker.alive for loan in self._loans.values()
        )

    def put(self, worker: Worker) -> None:
        """Adds a new idle worker, unless it has ended."""
        if worker.alive:
            self._loans[worker] = None
        self._serve()

    def remove(self, worker: Worker) -> None:
        """Removes an ended worker."""
        self._loans.pop(worker, None)

    async def _turn(self, place: Place) -> Loan:
        loop = asyncio.get_running_loop()
        place.granted, place.state, place.since = (
            loop.create_future(),
            State.WAITING,
            time.monotonic(),
        )
        line = self._waiting.setdefault(place.client, deque())
        line.insert(0 if place.begins_again else len(line), place)
        self._serve()
        claim = loop.call_later(PATIENCE, self._claim, place)
        try:
            return await place.granted
        except asyncio.CancelledError:
            if place.state is State.WAITING:
                self._leave(place)
            else:  # it was its turn at the same time
                self._return(place.granted.result())
            place.state = State.IDLE
            raise
        finally:
            claim.cancel()

    def _serve(self) -> None:
        """Lends idle workers to places in turn. It never raises, since other requests call it."""
        while (place := self._next()) and (worker := self._idle_worker()):
            self._leave(place)
            if (
                place.client in self._waiting
            ):  # the others of its client come after all other clients
                self._waiting[place.client] = self._waiting.pop(place.client)
            place.state = State.GRANTED
            assert place.granted is not None
            place.granted.set_result(self._lend(worker, place))
        self._changed.set()

    def _lend(self, worker: Worker, place: Place | None) -> Loan:
        del self._loans[worker]  # the last of those that are lent
        loan = self._loans[worker] = Loan(worker, place)
        return loan

    def _return(self, loan: Loan) -> None:
        """Returns a worker, which may have to end its task first."""
        loan.worker.when_free(lambda: self._take_back(loan))

    def _take_back(self, loan: Loan) -> None:
        if self._loans.get(loan.worker) is loan:
            del self._loans[loan.worker]  # the last of the idle ones
            self.put(loan.worker)

    def _idle_worker(self) -> Worker | None:
        return next(
            (worker for worker, loan in self._loans.items() if loan is None and worker.alive), None
        )

    def _working(self) -> Counter[str]:
        """Number of workers of every client."""
        loans = [
            loan
            for loan in self._loans.values()
            if loan is not None and loan.counts and loan.worker.alive
        ]
        return Counter(loan.place.client for loan in loans if loan.place is not None)

    def _next(self) -> Place | None:
        """The next place to be served. `_waiting` is ordered by turns."""
        working = self._working()
        heads = [
            next((place for place in line if place.waits), None) for line in self._waiting.values()
        ]

        def turn(place: Place) -> tuple[bool, int]:
            return place.gave_back and working[place.client] > 0, working[place.client]

        return min((place for place in heads if place), key=turn, default=None)

    def _leave(self, place: Place) -> None:
        """The place stands in line no longer."""
        line = self._waiting[place.client]
        line.remove(place)
        if not line:
            del self._waiting[place.client]
        self._changed.set()

    def _claim(self, place: Place) -> None:
        """Lets the client with the most workers give one back, if it has several and the place's
        client has none.
        """
        working = self._working()
        if working[place.client] or not place.waits:
            return
        lent = [
            (loan, loan.place)
            for loan in self._loans.values()
            if loan and loan.place and loan.counts
        ]
        stoppable = [
            (loan, holder)
            for loan, holder in lent
            if holder.give_back and working[holder.client] > 1
        ]
        # the most recent loan of the client with the most workers
        loan, holder = max(
            reversed(stoppable), key=lambda each: working[each[1].client], default=(None, None)
        )
        if loan is not None and holder is not None and holder.give_back is not None:
            give_back, holder.give_back = holder.give_back, None
            holder.gave_back, holder.state = True, State.YIELDING
            loan.counts = False  # at once: whoever claims next may not take its client's last one
            give_back()
