"""The dispatcher: it leases requests of jobs, has them run, and stores their outcomes."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from functools import partial

from joulepath.app.engine.task import Ended
from joulepath.app.exceptions.base import InternalError
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.jobs.changes import Changes
from joulepath.app.jobs.executor import Executor
from joulepath.app.jobs.heap import Heap, Held, Taker
from joulepath.app.jobs.holder import is_gone, new_holder
from joulepath.app.jobs.known_answers import Sorted, sort
from joulepath.app.jobs.progress import Found
from joulepath.app.jobs.work import defect, outcome_of
from joulepath.app.settings import Settings
from joulepath.app.store import jobs, leases
from joulepath.app.store.leases import Key, Outcome
from joulepath.app.store.store import Store
from joulepath.app.store.tables import now as present_time

logger = logging.getLogger(__name__)

LEASE = timedelta(seconds=30)
"""Length of a lease; leases are renewed after a third of it."""


@dataclass(frozen=True)
class DispatcherSettings:
    """Settings of the dispatcher."""

    look: float = 0.5
    """Time [s] between two queries of the database for new requests and cancelled ones."""
    ahead: float = 0.25
    """Work [s] leased ahead per worker, so that small requests share the cost of a transaction."""
    most_ahead: int = 32
    """Most requests leased ahead per worker."""
    gather: float = 0.05
    """Time [s] of collecting outcomes for one transaction while workers have more to do."""
    most_known: int = 64
    """Most requests leased beyond `most_ahead` if all earlier ones had known answers."""
    stop: float = 3.0
    """Longest time [s] of the last exchange with the database when the service stops."""
    longest_pause: float = 30.0
    """Longest time [s] until an unreachable database is tried again."""


DISPATCHER = DispatcherSettings()

PRUNING_PERIOD = 3600.0
"""Time [s] between two deletions of old jobs."""


@dataclass
class _Times:
    """When regular work was done last."""

    renewed: datetime
    pruned: float | None = None
    looked: float = field(default=0.0)
    reported: float = field(default=0.0)


class Dispatcher:
    """Works on as many requests of jobs at a time as its executor has slots.

    Some requests are leased ahead, so that no worker waits for the database. Only its loop reads
    and writes the queue. `now` is the clock of the leases.
    """

    def __init__(
        self,
        store: Store,
        executor: Executor,
        settings: Settings,
        now: Callable[[], datetime] = present_time,
    ) -> None:
        self.changes = Changes()
        self.holder = new_holder()
        self._store, self._executor, self._settings, self._now = store, executor, settings, now
        self._held: dict[Key, Held] = {}
        self._heap = Heap()
        self._outcomes: list[Outcome] = []
        self._bell = asyncio.Event()
        self._times = _Times(now())
        self._mean_work = DISPATCHER.ahead
        self._mean_of: dict[str, float] = {}
        self._more = True
        self._more_known = 0
        self._served = dict[str | None, None]()
        """Owners of leased requests, the latest one last."""
        self._draining = False
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def draining(self) -> bool:
        """Whether the service is stopping."""
        return self._draining

    def start(self) -> None:
        """Begins to work in the background."""
        self._tasks = [asyncio.create_task(self._dispatch())]

    def drain(self) -> None:
        """Stops all work; running requests wait again."""
        self._draining = True
        for held in self._held.values():
            held.drop()
        self.changes.ring_all()
        self._bell.set()

    async def stop(self) -> None:
        """Gives all leases back and ends."""
        self.drain()
        if self._tasks:
            # Requests leased just now are returned as well.
            await asyncio.wait(self._tasks[:1], timeout=DISPATCHER.stop)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._outcomes += [Outcome(held.lease, "waiting") for held in self._held.values()]
        if self._outcomes:
            try:
                await self._settle(self._outcomes)
            except StoreUnavailable:
                logger.warning("leases could not be given back: they run out by themselves")

    def wake(self) -> None:
        """There is something to do."""
        self._bell.set()

    def stop_job(self, job_id: str) -> None:
        """Stops the work on a job at once."""
        for held in self._held.values():
            if held.lease.job_id == job_id:
                held.drop()

    async def _run(self) -> None:
        """Has leased requests run."""
        while True:
            await self._heap.filled()
            taker = Taker(
                self._heap, self._ended, lambda kind: self._mean_of.get(kind, DISPATCHER.ahead)
            )
            taker.working = working = asyncio.create_task(self._executor.run(taker.take))
            try:
                await asyncio.wait({working})
            finally:
                taker.close()
                working.cancel()
            left = list(taker.left)
            error = None if working.cancelled() else working.exception()
            if error is not None:
                for held in left:
                    self._ended(held, error if isinstance(error, Exception) else InternalError())
                continue
            self._heap.put_back(held for held in left if not held.dropped)
            for held in left:
                if held.dropped:
                    self._give_back(held)

    def _ended(self, held: Held, how: Ended) -> None:
        outcome = replace(outcome_of(held.lease, how, held.began), asked=held.asked)
        taken, kind = outcome.wall_time, held.lease.kind
        if taken is not None:
            self._mean_work += 0.2 * (taken - self._mean_work)
            self._mean_of[kind] = self._mean_of.get(kind, taken) + 0.2 * (
                taken - self._mean_of.get(kind, taken)
            )
        self._has_outcome(held, outcome)

    def _give_back(self, held: Held) -> None:
        """Returns an unwanted request to the queue, unless `settle` knows its job as cancelled."""
        self._has_outcome(held, Outcome(held.lease, "waiting"))

    def _has_outcome(self, held: Held, outcome: Outcome) -> None:
        self._outcomes.append(outcome)
        if self._held.get(held.lease.key) is held:
            del self._held[held.lease.key]
        self._bell.set()

    async def _dispatch(self) -> None:
        """Exchanges leases and outcomes with the database."""
        fresh, pause = True, DISPATCHER.look
        while not self._draining:
            try:
                if fresh:
                    await self._store.write(partial(leases.take_back_from, is_gone=is_gone))
                    fresh = False
                await self._exchange()
                pause = DISPATCHER.look
            except Exception as error:
                if not isinstance(error, StoreUnavailable):
                    logger.exception("unforeseen error")
                pause = min(2 * pause, DISPATCHER.longest_pause)
            await self.changes.wait(self._bell, pause)
            if len(self._heap) >= self._executor.slots and not self._draining:
                await asyncio.sleep(DISPATCHER.gather)

    async def _exchange(self) -> None:
        await self._store_outcomes()
        await self._watch()
        await self._report()
        # One task dispatches; tasks beyond the slots find nothing to do.
        more = self._executor.slots + 1 - len(self._tasks)
        self._tasks += [asyncio.create_task(self._run()) for _ in range(more)]
        want = self._most_held + self._more_known - len(self._held)
        if want <= 0 or not self._executor.slots or self._draining:
            return
        now = self._now()
        if self._more or await self._store.read(partial(leases.is_due, now=now)):
            lease = partial(
                leases.lease,
                holder=self.holder,
                count=want,
                now=now,
                until=now + LEASE,
                served=tuple(self._served),
            )
            leased, changed = await self._store.write(lease)
            for each in leased:
                self._served.pop(each.owner, None)
                self._served[each.owner] = None
            self._more = len(leased) == want
            self.changes.ring(changed)
            fresh = [Held(each, Found(each.attempt), dropped=self._draining) for each in leased]
            self._held |= {held.lease.key: held for held in fresh}
            if await self._begin(fresh) or not fresh:
                self._more_known = 0
            else:  # where all were known, more may be
                self._more_known = min(max(1, 2 * self._more_known), DISPATCHER.most_known)

    async def _begin(self, held: list[Held]) -> int:
        """Starts requests without a known answer, and returns their number."""
        wanted = [each for each in held if not each.dropped]
        for each in held:
            if each.dropped:
                self._give_back(each)
        try:
            found = await sort(self._store, wanted)
        except Exception as error:
            if not isinstance(error, StoreUnavailable):
                logger.exception("unforeseen error")
            found = Sorted(wanted, {})  # computed twice is better than never
        self._heap.put(*found.to_compute)
        for each, outcome in found.known.items():
            self._has_outcome(each, outcome)
        return len(found.to_compute)

    @property
    def _most_held(self) -> int:
        """Most leased requests: one per worker, and some ahead."""
        ahead = max(
            1,
            round(
                DISPATCHER.ahead / max(self._mean_work, DISPATCHER.ahead / DISPATCHER.most_ahead)
            ),
        )
        return self._executor.slots * (1 + ahead)

    @staticmethod
    def _clock() -> float:
        return asyncio.get_running_loop().time()

    async def _store_outcomes(self) -> None:
        outcomes, self._outcomes = self._outcomes, []
        if not outcomes:
            return
        try:
            changed = await self._settle(outcomes)
        except StoreUnavailable:
            self._outcomes = outcomes + self._outcomes
            raise
        except Exception:
            # Clients must not wait forever for these answers.
            self._outcomes = [defect(each.lease) for each in outcomes] + self._outcomes
            raise
        self.changes.ring(changed)

    async def _watch(self) -> None:
        """Renews leases, stops cancelled requests, and deletes old jobs."""
        now, clock = self._now(), self._clock()
        # A clock that was set back would otherwise leave leases that outlast their holder.
        if self._held and abs(now - self._times.renewed) >= LEASE / 3:
            await self._store.write(partial(leases.renew, holder=self.holder, until=now + LEASE))
            self._times.renewed = now
        if self._held and clock - self._times.looked >= DISPATCHER.look:
            held = list(self._held.values())
            kept = await self._store.read(partial(leases.kept, holder=self.holder))
            self._times.looked = clock
            for each in held:
                if (each.lease.key, each.lease.attempt) not in kept:
                    each.drop()
        if self._times.pruned is None or clock - self._times.pruned >= PRUNING_PERIOD:
            prune = partial(jobs.prune, max_age=timedelta(days=self._settings.answers_max_age))
            await self._store.write(prune, frees=True)
            self._times.pruned = clock

    async def _report(self) -> None:
        """Records progress within requests."""
        fresh = {held.lease.key: held.found for held in self._held.values() if held.found.is_news}
        if fresh and self._clock() - self._times.reported >= DISPATCHER.look:
            self._times.reported = self._clock()
            reports = {key: found.report for key, found in fresh.items()}
            report = partial(leases.report, holder=self.holder, reports=reports, now=self._now())
            changed = await self._store.write(report)
            for (job_id, number), found in fresh.items():
                found.is_news = job_id not in changed or found.report is not reports[job_id, number]
            self.changes.ring(changed)

    async def _settle(self, outcomes: list[Outcome]) -> set[str]:
        most = self._settings.max_figures
        settle = partial(
            leases.settle, holder=self.holder, outcomes=outcomes, now=self._now(), most=most
        )
        return await self._store.write(settle)
