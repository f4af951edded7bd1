"""A machine of a cluster: a Dask worker reconnecting to a restarted scheduler."""

from __future__ import annotations

import asyncio
import logging
import signal

from joulepath.app.settings import Settings

logger = logging.getLogger(__name__)

_PAUSE = 2.0
"""Time [s] between two attempts to reach a lost scheduler."""


async def serve(address: str, settings: Settings) -> None:
    """Works for the scheduler at `address` until SIGTERM or Ctrl-C.

    Other machines repeat its unfinished work.
    """
    from distributed import Worker

    stopped, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stopped.set)
    stopping = asyncio.create_task(stopped.wait())
    while not stopped.is_set():
        # The computing processes do not belong to Dask, which must not watch their memory.
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
