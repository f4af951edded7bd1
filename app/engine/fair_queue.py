"""Whose turn it is: clients share the workers evenly, and none can take all places of the queue."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import Generic, Protocol, TypeVar

from app.exceptions import Busy, TooManyRequests


class Usable(Protocol):
    """What tasks wait for."""

    @property
    def alive(self) -> bool:
        """Whether it can run a task."""


W = TypeVar("W", bound=Usable)

PATIENCE = 2.0
"""Time [s] that a client without a worker waits, before a client that has several gives one back."""


class Place(Generic[W]):
    """A request's place in the queue, from its arrival to its answer."""

    def __init__(self, client: str) -> None:
        self.client = client
        self.gave_back = False
        """Whether it had to give its worker back. Then it waits until its client has no other worker."""
        self.give_back: Callable[[], object] | None = None
        """Stops the task at once. Set while it is in a worker and may be stopped."""
        self.counts = False
        """Whether it counts as one that has a worker."""
        self.granted: asyncio.Future[W] | None = None


class FairQueue(Generic[W]):
    """Hands workers to those who wait: first to the client that has the fewest, among equals in turn.

    `capacity`: most requests in workers and waiting. `share`: most of one client.
    """

    def __init__(self, capacity: int, share: int) -> None:
        self._capacity, self._share = capacity, share
        self._places: Counter[str] = Counter()
        self._working: Counter[str] = Counter()
        self._started: list[Place[W]] = []
        self._waiting: dict[str, deque[Place[W]]] = {}
        self._idle: deque[W] = deque()
        self._changed = asyncio.Event()

    @contextmanager
    def place(self, client: str) -> Iterator[Place[W]]:
        """A place in the queue. Raises TooManyRequests or Busy."""
        if self._places[client] >= self._share:
            raise TooManyRequests
        if self._places.total() >= self._capacity:
            raise Busy
        self._places[client] += 1
        try:
            yield Place(client)
        finally:
            _decrease(self._places, client)

    @asynccontextmanager
    async def worker(self, place: Place[W]) -> AsyncIterator[W]:
        """A worker, when it is the place's turn."""
        worker = await self._turn(place)
        self._started.append(place)
        try:
            yield worker
        finally:
            place.give_back = None
            self._started.remove(place)
            self._release(place)
            self.put(worker)

    @property
    def someone_waits(self) -> bool:
        """Whether a request waits for a worker. May be read in any thread."""
        return bool(self._waiting)

    def put(self, worker: W) -> None:
        """Takes a worker that has nothing to do. One that has ended is left out."""
        if worker.alive:
            self._idle.append(worker)
        self._serve()

    async def spare(self) -> W:
        """A worker that nobody waits for, as soon as there is one. It is to be given back by `put`."""
        while True:
            if self._next() is None and (worker := self._idle_worker()):
                return worker
            self._changed.clear()
            await self._changed.wait()

    async def _turn(self, place: Place[W]) -> W:
        loop = asyncio.get_running_loop()
        place.granted = loop.create_future()
        line = self._waiting.setdefault(place.client, deque())
        # who gave a worker back is the first of its client
        line.insert(0 if place.gave_back else len(line), place)
        self._serve()
        claim = loop.call_later(PATIENCE, self._claim, place)
        try:
            return await place.granted
        except asyncio.CancelledError:
            if place.granted.cancelled():
                self._leave(place)
            else:  # it was its turn at the same time
                self._release(place)
                self.put(place.granted.result())
            raise
        finally:
            claim.cancel()

    def _serve(self) -> None:
        while (place := self._next()) and (worker := self._idle_worker()):
            self._leave(place)
            place.counts = True
            self._working[place.client] += 1
            assert place.granted is not None
            place.granted.set_result(worker)
        self._changed.set()

    def _idle_worker(self) -> W | None:
        while self._idle:
            worker = self._idle.popleft()
            if worker.alive:
                return worker
        return None

    def _next(self) -> Place[W] | None:
        """Whose turn it is. The order of `_waiting` is that of the turns."""
        heads = [line[0] for line in self._waiting.values()]
        allowed = [place for place in heads if not (place.gave_back and self._working[place.client])]
        return min(allowed, key=lambda place: self._working[place.client], default=None)

    def _leave(self, place: Place[W]) -> None:
        """The place waits no longer; if its client has others, these come after all other clients'."""
        line = self._waiting.pop(place.client)
        line.remove(place)
        if line:
            self._waiting[place.client] = line
        self._changed.set()

    def _claim(self, place: Place[W]) -> None:
        """Lets the client with the most workers give one back, if it has several and the place's client has none."""
        if self._working[place.client]:
            return
        stoppable = [each for each in self._started if each.give_back and self._working[each.client] > 1]
        # the last one of the client that has the most
        most = max(reversed(stoppable), key=lambda each: self._working[each.client], default=None)
        if most is not None and most.give_back is not None:
            give_back, most.give_back = most.give_back, None
            most.gave_back = True
            self._release(most)  # at once: whoever claims next may not take its client's last one
            give_back()

    def _release(self, place: Place[W]) -> None:
        """The place no longer counts as one that has a worker."""
        if place.counts:
            place.counts = False
            _decrease(self._working, place.client)


def _decrease(counter: Counter[str], name: str) -> None:
    """Counts one less; forgets what is zero, so that names of clients do not pile up."""
    counter[name] -= 1
    if counter[name] <= 0:
        del counter[name]
