"""A machine of a cluster as a process of its own: a Dask worker that comes back when its scheduler
does.
"""

from __future__ import annotations

import asyncio
import logging
import signal

from joulepath.app.settings import Settings

logger = logging.getLogger(__name__)

_PAUSE = 2.0
"""Time [s] until a scheduler that was lost is tried again."""


async def serve(address: str, settings: Settings) -> None:
    """Works for the scheduler at `address` until SIGTERM or Ctrl-C. What it is at work on then is
    done elsewhere.
    """
    from distributed import Worker

    stopped, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stopped.set)
    stopping = asyncio.create_task(stopped.wait())
    while not stopped.is_set():
        # the processes that compute are none of Dask's: it is not to watch their memory
        worker = Worker(
            address,
            nthreads=settings.workers,
            memory_limit=0,
            preload=["joulepath.app.cluster"],
            dashboard=False,
        )
        working = asyncio.ensure_future(_until_closed(worker))
        await asyncio.wait({working, stopping}, return_when=asyncio.FIRST_COMPLETED)
        if stopped.is_set():
            await worker.close(reason="stopped")
        elif error := working.exception():
            logger.error(
                "the scheduler cannot be reached",
                extra={"scheduler": address, "reason": str(error)},
            )
        working.cancel()
        await asyncio.gather(working, return_exceptions=True)
        await asyncio.wait({stopping}, timeout=_PAUSE)


async def _until_closed(worker: object) -> None:
    async with worker as running:  # type: ignore[attr-defined]
        await running.finished()
