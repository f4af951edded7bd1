"""Cancellation of the work for a client after it has closed its connection."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

from fastapi import Request

from joulepath.app.exceptions.queue import ClientDisconnected

T = TypeVar("T")


async def unless_disconnected(request: Request, work: Coroutine[Any, Any, T]) -> T:
    """The work's result. If the client closes the connection, cancels the work and raises
    ClientDisconnected.

    The body of the request must have been read.
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
    """Returns when the client closes the connection. The body of the request must have been
    read."""
    # the body has been read: the next message is the end of the connection
    while (await request.receive())["type"] != "http.disconnect":
        pass
