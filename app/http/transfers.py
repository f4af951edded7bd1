"""Keys, bodies and answers of requests in transfer."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from joulepath.app.access.key_ring import KeyRing
from joulepath.app.exceptions.base import ServiceError
from joulepath.app.exceptions.queue import Busy
from joulepath.app.http.authentication import authenticate
from joulepath.app.http.bodies import Bodies, RequestBody
from joulepath.app.http.bytes_in_flight import BytesInFlight, Held
from joulepath.app.http.client import client_of
from joulepath.app.http.compression import Coding, Compression
from joulepath.app.http.handlers import problem_response
from joulepath.app.http.open_requests import OpenRequests


class Transfers:
    """ASGI middleware: bodies within limits, and answers compressed and sent in pieces.

    A request without a valid key in `keys`, without an acceptable coding, or beyond the share of
    its client is refused before its body is read.
    """

    def __init__(self, app: ASGIApp, bodies: Bodies, keys: KeyRing | None) -> None:
        self._app, self._bodies, self._keys = app, bodies, keys
        self._compression = Compression()
        settings = bodies.settings
        self._in_flight = BytesInFlight(
            settings.max_bytes_in_flight, settings.client_bytes_in_flight
        )
        self._open = OpenRequests(settings.client_connections)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        try:
            if self._keys is not None:
                authenticate(request, self._keys)
            coding = self._compression.preferred(
                ",".join(request.headers.getlist("accept-encoding"))
            )
            client = client_of(request).name
            is_open = self._open.another(client)
        except ServiceError as error:
            await (await problem_response(request, error))(scope, receive, send)
            return
        with (
            is_open,
            Held(self._in_flight, client) as body_held,
            Held(self._in_flight, client) as answer_held,
        ):
            body = RequestBody(self._bodies, request, receive, body_held)
            answer = _Answer(request, receive, send, answer_held, self._compression, coding)
            await self._app(scope, body.receive, answer.send)


class _Answer:
    """The answer to one request; without room for it, a problem is sent instead.

    Without room for an event of a stream, TooManyBytes or TooManyBytesOfClient is raised.
    """

    piece: int = 1 << 18
    """Bytes passed to the connection at a time; the next piece waits for the client."""

    def __init__(
        self,
        request: Request,
        receive: Receive,
        send: Send,
        held: Held,
        compression: Compression,
        coding: Coding,
    ) -> None:
        self._request, self._receive, self._send, self._held = request, receive, send, held
        self._compression, self._coding = compression, coding
        self._start: Message | None = None
        self._is_dropped = self._is_by_events = False

    async def send(self, message: Message) -> None:
        """Sends a message. The head of the answer waits for the first part of its body."""
        if self._is_dropped:
            return
        if message["type"] == "http.response.start":
            self._start = message
            return
        if self._start is not None:
            start, self._start = self._start, None
            message = await self._compression.encoded(start, message, self._coding)
            headers = Headers(raw=start["headers"])
            self._is_by_events = headers.get("content-type", "").startswith("text/event-stream")
            try:
                self._held.hold(int(headers.get("content-length", 0)))  # a stream declares none
            except Busy as error:
                self._is_dropped = True
                response = await problem_response(self._request, error)
                await response(self._request.scope, self._receive, self._send)
                return
            await self._send(start)
        body = memoryview(message.get("body", b""))
        if self._is_by_events:
            self._held.hold(len(body))
        while len(body) > self.piece:
            await self._send(
                {"type": "http.response.body", "body": body[: self.piece], "more_body": True}
            )
            body = body[self.piece :]
        await self._send({**message, "body": body})
