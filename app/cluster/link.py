"""The service's link to a cluster: it is kept up, and says how much work the machines can take."""

from __future__ import annotations

import asyncio
import logging
import pickle
import uuid
from concurrent.futures import CancelledError as Cancelled
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from joulepath.app.cluster.machine import RESOURCES, compute, resource
from joulepath.app.engine.code_version import code_version
from joulepath.app.engine.task import Ended, Take, Work
from joulepath.app.exceptions.queue import ClusterUnavailable, WorkerLost
from joulepath.optimizer.progress import no_listener

if TYPE_CHECKING:
    from distributed import Client, Future

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class LinkSettings:
    """Settings of the link to the scheduler."""

    look: float = 0.5
    """Time [s] between two checks of the machines, and between two attempts to connect."""
    together: float = 0.25
    """Work [s] combined into one task of Dask."""
    per_process: int = 2
    """Tasks of Dask per process of a machine: the next one is ready when one ends."""
    patience: float = 5.0
    """Longest time [s] until the scheduler's answer."""


LINK = LinkSettings()


class _Unsuitable(Exception):
    """The scheduler cannot pass on tasks; the message says why."""


class Cluster:
    """A Dask cluster with a scheduler at `address`."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._client: Client | None = None
        self._workers: dict[str, int] = {}
        self._others: set[str] = set()
        self._topic = f"joulepath-{uuid.uuid4().hex}"
        self._works: dict[str, list[Work]] = {}
        self._releasing: set[asyncio.Task[None]] = set()
        self._keeper: asyncio.Task[None] | None = None

    @property
    def workers(self) -> dict[str, int]:
        """Worker processes of the machines by address. Raises ClusterUnavailable."""
        if self._client is None:
            raise ClusterUnavailable
        return self._workers

    @property
    def slots(self) -> int:
        """Number of runs for full use of all machines; 0 without a scheduler."""
        return 0 if self._client is None else LINK.per_process * sum(self._workers.values())

    def start(self) -> None:
        """Connects in the background, and again whenever the connection is lost."""
        self._keeper = asyncio.create_task(self._keep())

    async def stop(self) -> None:
        """Closes the connection. The scheduler forgets the tasks of this service."""
        if self._keeper is not None:
            self._keeper.cancel()
            await asyncio.gather(self._keeper, *self._releasing, return_exceptions=True)

    async def run(self, take: Take) -> None:
        """Runs works on a machine one after another, several short ones as one task of Dask.

        A work ends with its result, its error, DeadlineExceeded, or WorkerLost. If cancelled, the
        work is stopped. Raises ClusterUnavailable.
        """
        works, expected = list[Work](), 0.0
        while expected < LINK.together and (work := take()) is not None:
            works.append(work)
            expected += work.expected
        if works:
            await self._run(works, expected)

    async def _run(self, works: list[Work], expected: float) -> None:
        from distributed import KilledWorker

        client = self._client
        if client is None:
            raise ClusterUnavailable
        key = f"joulepath-{uuid.uuid4().hex}"
        asked = [(work.task, work.deadline, work.tell is not no_listener) for work in works]
        self._works[key] = works
        # Short works share a process, so that the next ones are ready at the machine.
        is_long = len(works) == 1 and expected >= LINK.together
        use = {resource(): 1.0 if is_long else 1.0 / LINK.per_process}
        future = client.submit(
            compute, asked, key, self._topic, key=key, pure=False, retries=0, resources=use
        )
        try:
            ended: list[Ended] = await future.result()
        except KilledWorker:
            ended = [WorkerLost()]
        except (Cancelled, OSError) as error:
            ids = [work.task.request_id for work in works]
            logger.warning(
                "the cluster lost tasks", extra={"request_ids": ids, "reason": str(error)}
            )
            raise ClusterUnavailable from None
        finally:
            del self._works[key]
            self._release(future)
        if len(ended) < len(works):  # machines died of one of them
            for work in works:
                await self._run([work], LINK.together)
            return
        for work, each in zip(works, ended, strict=True):
            work.ended(each)

    def _release(self, future: Future[Any]) -> None:
        """Releases an unwanted task of the cluster."""
        if future.done():
            future.release()
            return

        async def cancel() -> None:
            try:
                await future.cancel()
            except (Cancelled, OSError):
                logger.debug("the cluster was lost with a task", extra={"key": future.key})

        releasing = asyncio.create_task(cancel())
        self._releasing.add(releasing)
        releasing.add_done_callback(self._releasing.discard)

    async def _keep(self) -> None:
        from distributed import Client

        told: str | None = None
        while True:
            try:
                async with Client(
                    self.address, asynchronous=True, timeout=LINK.patience, set_as_default=False
                ) as client:
                    await self._check(client)
                    client.subscribe_topic(self._topic, self._heard)
                    logger.info("cluster reached", extra={"scheduler": self.address})
                    told = None
                    await self._watch(client)
            except (OSError, TimeoutError, Cancelled, _Unsuitable) as error:
                kind = type(error).__name__
                if told != kind:
                    logger.error(
                        "the scheduler of the cluster cannot be used: jobs wait until it can",
                        extra={"scheduler": self.address, "reason": str(error) or kind},
                    )
                    told = kind
                if isinstance(error, _Unsuitable):  # each attempt leaves a traceback in its log
                    await asyncio.sleep(LINK.patience)
            await asyncio.sleep(LINK.look)

    async def _check(self, client: Client) -> None:
        """Raises _Unsuitable unless the scheduler, which unpickles tasks, has this version."""
        try:
            async with asyncio.timeout(LINK.patience):
                found = await client.run_on_scheduler(code_version)
        except (OSError, TimeoutError, Cancelled):
            raise
        except Exception as error:
            raise _Unsuitable(
                "the scheduler cannot import this package: install joulepath[cluster] there "
                f"({error!r})"
            ) from None
        if found != code_version():
            raise _Unsuitable(
                "the scheduler has another version of this package: install the same one on all "
                f"machines (there {found}, here {code_version()})"
            )

    async def _watch(self, client: Client) -> None:
        """Until the connection is lost. Raises OSError or TimeoutError if the scheduler does not
        answer.
        """
        scheduler = client.scheduler
        assert scheduler is not None
        try:
            while client.status == "running":
                async with asyncio.timeout(LINK.patience):
                    known = await scheduler.identity()
                has = {name: each["resources"] for name, each in known["workers"].items()}
                found = {name: int(each.get(resource(), 0)) for name, each in has.items()}
                self._workers = {name: count for name, count in found.items() if count}
                self._tell_others(
                    {
                        name
                        for name, each in has.items()
                        if any(map(_is_ours, each)) and not found[name]
                    }
                )
                self._client = client
                await asyncio.sleep(LINK.look)
        finally:
            self._client = None
        raise OSError("the connection was lost")

    def _tell_others(self, others: set[str]) -> None:
        """Logs once why a machine with another version gets no work."""
        if new := others - self._others:
            logger.warning(
                "machines of another version get no work: install the same one there",
                extra={"machines": sorted(new), "version": code_version()},
            )
        self._others = others

    def _heard(self, event: tuple[float, dict[str, Any]]) -> None:
        """Handles an event of a task."""
        _, message = event
        works = self._works.get(message["key"])
        if works is not None:
            for index, each in pickle.loads(message["events"]):
                works[index].tell(each)


def _is_ours(name: str) -> bool:
    return name.startswith(RESOURCES)
