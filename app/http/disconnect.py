"""Work that nobody waits for any more is cancelled."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine

from fastapi import Request

from app.engine.reply import Reply
from app.exceptions import ClientDisconnected


async def unless_disconnected(request: Request, work: Coroutine[None, None, Reply]) -> Reply:
    """The work's result; the work is cancelled when the caller hangs up. Raises ClientDisconnected.

    The request's body must have been read.
    """
    working, listening = asyncio.create_task(work), asyncio.create_task(_disconnected(request))
    try:
        await asyncio.wait({working, listening}, return_when=asyncio.FIRST_COMPLETED)
        if working.done():
            return working.result()
        raise ClientDisconnected
    finally:
        working.cancel()
        listening.cancel()
        await asyncio.gather(working, listening, return_exceptions=True)


async def _disconnected(request: Request) -> None:
    # the body has been read: nothing else comes
    while (await request.receive())["type"] != "http.disconnect":
        pass
