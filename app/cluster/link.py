"""The service's link to a cluster: it is kept up, and says how much work the machines can take."""

from __future__ import annotations

import asyncio
import logging
import pickle
import uuid
from concurrent.futures import CancelledError as Cancelled
from typing import TYPE_CHECKING, Any

from app.cluster.machine import RESOURCE, Ended, compute
from app.engine.result import TaskResult
from app.engine.task import Task
from app.exceptions import ClusterUnavailable, WorkerDied
from optimizer.progress import Tell, nobody

if TYPE_CHECKING:
    from distributed import Client, Future

logger = logging.getLogger(__name__)

LOOK = 0.5
"""Time [s] between two looks at the machines, and between two attempts to reach the scheduler."""
_PATIENCE = 5.0
"""Time [s] in which the scheduler must answer."""


class Cluster:
    """A Dask cluster whose scheduler listens at `address`."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._client: Client | None = None
        self._workers: dict[str, int] = {}
        self._topic = f"joulepath-{uuid.uuid4().hex}"
        self._tells: dict[str, Tell] = {}
        self._releasing: set[asyncio.Task[None]] = set()
        self._keeper: asyncio.Task[None] | None = None

    @property
    def workers(self) -> dict[str, int]:
        """Worker processes of each machine, by its address. Raises ClusterUnavailable."""
        if self._client is None:
            raise ClusterUnavailable
        return self._workers

    @property
    def slots(self) -> int:
        """Tasks that the machines can compute at the same time; 0 if the scheduler cannot be reached."""
        return 0 if self._client is None else sum(self._workers.values())

    def start(self) -> None:
        """Connects in the background, and again whenever the connection is lost."""
        self._keeper = asyncio.create_task(self._keep())

    async def stop(self) -> None:
        """Closes the connection. The scheduler forgets the tasks of this service."""
        if self._keeper is not None:
            self._keeper.cancel()
            await asyncio.gather(self._keeper, *self._releasing, return_exceptions=True)

    async def run(self, task: Task, deadline: float, tell: Tell = nobody) -> TaskResult:
        """The task's result from some machine; `deadline` [s] counts from the begin of the work there.

        `tell` gets what the task finds. If cancelled, the work is stopped. Raises what the task raises,
        DeadlineExceeded, WorkerDied, or ClusterUnavailable.
        """
        from distributed import KilledWorker

        client = self._client
        if client is None:
            raise ClusterUnavailable
        key = f"joulepath-{uuid.uuid4().hex}"
        topic = None if tell is nobody else self._topic
        self._tells[key] = tell
        once = {"pure": False, "retries": 0, "resources": {RESOURCE: 1}}
        future = client.submit(compute, task, deadline, key, topic, key=key, **once)
        try:
            ended: Ended = await future.result()
        except KilledWorker:
            raise WorkerDied from None
        except (Cancelled, OSError) as error:
            logger.warning("the cluster lost a task", extra={"request_id": task.request_id, "reason": str(error)})
            raise ClusterUnavailable from None
        finally:
            del self._tells[key]
            self._release(future)
        if isinstance(ended, Exception):
            raise ended
        return ended

    def _release(self, future: Future[Any]) -> None:
        """Has the cluster forget a task: nobody waits for it any more."""
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

        is_told = False
        while True:
            try:
                async with Client(self.address, asynchronous=True, timeout=_PATIENCE, set_as_default=False) as client:
                    client.subscribe_topic(self._topic, self._heard)
                    logger.info("cluster reached", extra={"scheduler": self.address})
                    is_told = False
                    await self._watch(client)
            except (OSError, TimeoutError) as error:
                if not is_told:
                    logger.error(
                        "the scheduler of the cluster cannot be reached: jobs wait until it can",
                        extra={"scheduler": self.address, "reason": str(error)},
                    )
                    is_told = True
            await asyncio.sleep(LOOK)

    async def _watch(self, client: Client) -> None:
        """Until the connection is lost. Raises OSError or TimeoutError if the scheduler does not answer."""
        scheduler = client.scheduler
        assert scheduler is not None
        try:
            while client.status == "running":
                async with asyncio.timeout(_PATIENCE):
                    known = await scheduler.identity()
                found = {name: int(each["resources"].get(RESOURCE, 0)) for name, each in known["workers"].items()}
                self._workers = {name: count for name, count in found.items() if count}
                self._client = client
                await asyncio.sleep(LOOK)
        finally:
            self._client = None
        raise OSError("the connection was lost")

    def _heard(self, event: tuple[float, dict[str, Any]]) -> None:
        """Something that a task has found."""
        _, message = event
        tell = self._tells.get(message["key"], nobody)
        for each in pickle.loads(message["events"]):
            tell(each)
