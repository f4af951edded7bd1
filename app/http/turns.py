"""Turns of the event loop: what many want at once is done a few at a time, so that others are answered meanwhile."""

from __future__ import annotations

import asyncio
from collections import deque


class Turns:
    """Lets at most `most` pass in one turn of the event loop, in the order in which they came."""

    def __init__(self, most: int) -> None:
        self._most = self._left = most
        self._waiting: deque[asyncio.Future[None]] = deque()
        self._is_counting = False

    async def next(self) -> None:
        """Returns when it is the caller's turn."""
        loop = asyncio.get_running_loop()
        if not self._is_counting:
            self._is_counting = True
            loop.call_soon(self._begin)
        if self._left and not self._waiting:
            self._left -= 1
            return
        mine = loop.create_future()
        self._waiting.append(mine)
        await mine

    def _begin(self) -> None:
        """A turn of the event loop begins."""
        self._left = self._most
        while self._waiting and self._left:
            first = self._waiting.popleft()
            if not first.done():  # who waited may have left
                first.set_result(None)
                self._left -= 1
        self._is_counting = self._left < self._most
        if self._is_counting:
            asyncio.get_running_loop().call_soon(self._begin)
