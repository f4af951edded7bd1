"""Counts the bytes of bodies and answers in flight, gives a body a time to arrive, and sends answers piece by piece."""

from __future__ import annotations

import asyncio
from collections import Counter

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from joulepath.app.exceptions import RequestTimeout, TooManyBytes, TooManyBytesOfClient
from joulepath.app.http.client import client_of
from joulepath.app.http.handlers import problem_response
from joulepath.app.http.refused_body import RefusedBody
from joulepath.app.http.turns import Turns

_SMALL = 1 << 16
"""Largest body or answer [byte] that does not count: small requests find room whatever others hold."""
_PIECES = 2
"""Pieces of large bodies, of some 256 KiB, that are read in one turn of the event loop."""
_PIECE = 1 << 18
"""Bytes of an answer that are handed to the connection at a time: the next ones wait until the client has read."""


class BytesInFlight:
    """Bytes that the requests in flight hold, in all and by client."""

    def __init__(self, most: int, most_of_client: int) -> None:
        self._most, self._most_of_client = most, most_of_client
        self._total = 0
        self._by_client: Counter[str] = Counter()

    def add(self, client: str, size: int) -> None:
        """Counts `size` further bytes. Raises TooManyBytes or TooManyBytesOfClient, and counts nothing then."""
        if self._by_client[client] + size > self._most_of_client:
            raise TooManyBytesOfClient
        if self._total + size > self._most:
            raise TooManyBytes
        self._total += size
        self._by_client[client] += size

    def release(self, client: str, size: int) -> None:
        """Counts `size` bytes less."""
        self._total -= size
        self._by_client[client] -= size
        if not self._by_client[client]:
            del self._by_client[client]


class Bodies:
    """ASGI middleware: reading a body raises RefusedBody if there is no room for it, or if it takes too long.

    A declared size counts from the first read, so that a body for which there is no room is not read on. The pieces of
    large bodies have turns: the connections of those that wait are not read from.
    """

    def __init__(self, app: ASGIApp, in_flight: BytesInFlight, time: float) -> None:
        self._app, self._in_flight, self._time = app, in_flight, time
        self._turns = Turns(_PIECES)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        declared = Headers(scope=scope).get("content-length", "")
        expected = int(declared) if declared.isdecimal() else 0
        held = _Held(self._in_flight, client_of(Request(scope)).name)
        received, is_whole = 0, False
        until = asyncio.get_running_loop().time() + self._time

        async def counted() -> Message:
            nonlocal received, is_whole
            if is_whole:
                return await receive()
            try:
                async with asyncio.timeout_at(until):
                    if max(expected, received) > _SMALL:
                        await self._turns.next()
                    message = await receive()
                received += len(message.get("body", b""))
                held.hold(max(expected, received))
            except TimeoutError:
                raise RefusedBody(RequestTimeout(self._time)) from None
            except (TooManyBytes, TooManyBytesOfClient) as error:
                raise RefusedBody(error) from None
            is_whole = not message.get("more_body", False)
            return message

        try:
            await self._app(scope, counted, send)
        finally:
            held.release()


class Answers:
    """ASGI middleware: an answer for which there is no room is thrown away, and its client gets a problem.

    To send an event for which there is no room raises TooManyBytes or TooManyBytesOfClient.
    """

    def __init__(self, app: ASGIApp, in_flight: BytesInFlight) -> None:
        self._app, self._in_flight = app, in_flight

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        held: _Held | None = None
        is_dropped = is_by_events = False

        async def counted(message: Message) -> None:
            nonlocal held, is_dropped, is_by_events
            if is_dropped:
                return
            if message["type"] == "http.response.start":
                held = _Held(self._in_flight, client_of(Request(scope)).name)  # whose key is known by now
                headers = Headers(raw=message["headers"])
                is_by_events = headers.get("content-type", "").startswith("text/event-stream")
                try:
                    # a stream declares no size: it is sent as it is made
                    held.hold(int(headers.get("content-length", "0")))
                except (TooManyBytes, TooManyBytesOfClient) as error:
                    is_dropped = True
                    await (await problem_response(Request(scope), error))(scope, receive, send)
                    return
            elif is_by_events and held is not None:
                held.hold(len(message.get("body", b"")))
            await _send_in_pieces(message, send)

        try:
            await self._app(scope, receive, counted)
        finally:
            if held is not None:
                held.release()


class _Held:
    """What one request holds."""

    def __init__(self, in_flight: BytesInFlight, client: str) -> None:
        self._in_flight, self._client, self._size = in_flight, client, 0

    def hold(self, size: int) -> None:
        """Holds `size` bytes from now on, if that is more. Raises TooManyBytes or TooManyBytesOfClient."""
        if size > max(self._size, _SMALL):
            self._in_flight.add(self._client, size - self._size)
            self._size = size

    def release(self) -> None:
        """Holds nothing any more."""
        self._in_flight.release(self._client, self._size)
        self._size = 0


async def _send_in_pieces(message: Message, send: Send) -> None:
    """Returns when the client has read nearly all of it."""
    if message["type"] != "http.response.body":
        await send(message)
        return
    body = memoryview(message.get("body", b""))
    while len(body) > _PIECE:
        await send({"type": "http.response.body", "body": body[:_PIECE], "more_body": True})
        body = body[_PIECE:]
    await send({**message, "body": body})
