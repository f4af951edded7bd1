"""Operations on jobs: create, cancel, retry and delete."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from joulepath.app.access.client import Client
from joulepath.app.jobs.dispatcher import Dispatcher
from joulepath.app.settings import Settings
from joulepath.app.store import jobs
from joulepath.app.store.jobs import JobView, NewJob
from joulepath.app.store.store import Store


@dataclass(frozen=True)
class Jobs:
    """The jobs in the database, and the dispatcher of this service."""

    store: Store
    dispatcher: Dispatcher
    settings: Settings

    async def create(self, new: NewJob, key: str | None, owner: str | None) -> tuple[str, bool]:
        """See `joulepath.app.store.jobs.create`. Raises KeyReused, TooManyWaiting or
        StoreUnavailable.
        """
        made = await self.store.create(
            partial(
                jobs.create, new=new, key=key, most_waiting=self.settings.max_waiting, owner=owner
            )
        )
        self.dispatcher.wake()
        return made

    async def view(self, job_id: str) -> JobView:
        """A job and its counts. Raises UnknownJob or StoreUnavailable."""
        return await self.store.read(partial(jobs.view, job_id=job_id))

    async def cancel(self, job_id: str, client: Client) -> None:
        """Cancels a job. Raises UnknownJob, NotOwner, JobNotCancellable or StoreUnavailable."""
        await self.store.write(partial(jobs.cancel, job_id=job_id, client=client))
        self._has_changed(job_id, stop=True)

    async def retry(self, job_id: str, client: Client) -> None:
        """Lets failed and cancelled requests wait again. Raises UnknownJob, NotOwner,
        TooManyWaiting or StoreUnavailable."""
        write = partial(
            jobs.retry, job_id=job_id, client=client, most_waiting=self.settings.max_waiting
        )
        await self.store.write(write)
        self._has_changed(job_id)

    async def delete(self, job_id: str, client: Client) -> None:
        """Stops and deletes a job with its answers.

        Raises UnknownJob, NotOwner or StoreUnavailable.
        """
        await self.store.write(partial(jobs.delete, job_id=job_id, client=client), frees=True)
        self._has_changed(job_id, stop=True)

    def _has_changed(self, job_id: str, stop: bool = False) -> None:
        if stop:
            self.dispatcher.stop_job(job_id)
        self.dispatcher.changes.ring([job_id])
        self.dispatcher.wake()
