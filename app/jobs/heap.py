"""The queue of leased requests, and its consumers."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from joulepath.app.engine.task import Ended, Work
from joulepath.app.jobs.progress import HEARD, Found
from joulepath.app.jobs.work import RETRY, task_of
from joulepath.app.store.cache import Asked
from joulepath.app.store.leases import Lease
from joulepath.optimizer.progress import no_listener

SMALL = 1 << 12
"""Size of a small request [byte], compressed."""


@dataclass(eq=False)
class Held:
    """A lease and the work on it.

    `began` [s] is its start by `perf_counter`. `dropped`: the request is no longer wanted.
    `motions` are known motions of the cell of a cycle.
    """

    lease: Lease
    found: Found
    taker: Taker | None = None
    began: float = 0.0
    dropped: bool = False
    asked: Asked | None = None
    motions: Mapping[str, bytes] = field(default_factory=dict)

    def drop(self) -> None:
        """Stops the work on it."""
        self.dropped = True
        # A taker registers before it checks `dropped`.
        if self.taker is not None:
            self.taker.stop()


class Heap:
    """Leased requests in the order of work. Takers consume it in threads."""

    def __init__(self) -> None:
        self.ready: deque[Held] = deque()
        self._filled = asyncio.Event()

    def __len__(self) -> int:
        return len(self.ready)

    def put(self, *held: Held) -> None:
        """Adds requests at the end."""
        self.ready.extend(held)
        self._filled.set()

    def put_back(self, held: Iterable[Held]) -> None:
        """Adds taken but unprocessed requests at the beginning."""
        self.ready.extendleft(reversed(list(held)))
        self._filled.set()

    async def filled(self) -> None:
        """Waits until there is a request."""
        while not self.ready:
            self._filled.clear()
            await self._filled.wait()


class Taker:
    """Takes requests for one run of an executor.

    `ended` receives the outcome of a request as long as it is in `left`. `expected` returns the
    likely time [s] of a kind of request.
    """

    def __init__(
        self, heap: Heap, ended: Callable[[Held, Ended], object], expected: Callable[[str], float]
    ) -> None:
        self.left: dict[Held, None] = {}
        """Taken requests without an outcome, in order."""
        self.working: asyncio.Task[None] | None = None
        self._heap, self._ended, self._expected = heap, ended, expected
        self._lock = threading.Lock()
        self._is_open = True

    def take(self) -> Work | None:
        """The next request; None if there is none. May be called in any thread."""
        with self._lock:
            while self._is_open:
                try:
                    held = self._heap.ready.popleft()
                except IndexError:
                    return None
                held.taker = self
                self.left[held] = None
                if not held.dropped:
                    return self._work(held)
        return None

    def stop(self) -> None:
        """Stops the run at once."""
        if self.working is not None:
            self.working.cancel()

    def close(self) -> None:
        """Takes nothing more."""
        with self._lock:
            self._is_open = False

    def _work(self, held: Held) -> Work:
        lease = held.lease
        held.began = time.perf_counter()

        def ended(how: Ended) -> None:
            # After a stop, the request belongs to another run.
            if self._is_open and held in self.left:
                del self.left[held]
                self._ended(held, how)

        tell = held.found.tell if lease.kind in HEARD else no_listener
        stoppable = lease.preempted < RETRY.preemptions
        is_small = len(lease.body) + sum(map(len, held.motions.values())) <= SMALL
        task, expected = task_of(lease, held.motions), self._expected(lease.kind)
        return Work(task, lease.deadline, ended, stoppable, tell, expected, is_small)
