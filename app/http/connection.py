"""uvicorn's HTTP protocol with ceilings: on connections, and on the bytes and the time of what they carry.

uvicorn waits for ever for a head, for a body, and for a client that does not read its answer. Here the server calls
`Connection.check` every half second, which ends what takes too long.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import struct
import uuid
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from http import HTTPStatus
from ipaddress import IPv4Network, IPv6Network, ip_address
from typing import Any, ClassVar

import httptools
from uvicorn._types import ASGI3Application
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from joulepath.app.access.client import Client
from joulepath.app.engine.result import json_document
from joulepath.app.exceptions import (
    HeadTooLarge,
    MalformedHttp,
    RequestTimeout,
    ServiceError,
    ShuttingDown,
    TooManyConnections,
    TooManyConnectionsOfClient,
)
from joulepath.app.http.handlers import PROBLEM_MEDIA_TYPE
from joulepath.app.http.problem_details import problem_content, problem_type

logger = logging.getLogger("app.connection")

_NO_LINGER = struct.pack("ii", 1, 0)
_LINGER = 1.0
"""Time [s] in which a refused client may read why. What it still sends is thrown away."""
_MOST_DISCARDED = 1 << 23
"""Most bytes of that."""
_MOST_AHEAD = 16
"""Most requests that a client may send on one connection before it is answered (pipelining)."""
_BODY_SLACK = 2.0
"""Time [s] after which a body is cut that nobody reads; one that a route reads has been answered by then."""


@dataclass(frozen=True)
class Ceilings:
    """Limits of connections, and the connections that there are.

    `head_time`, `body_time`: for a whole head, a whole body [s]. `write_time`: for the next 64 KiB of an answer [s].
    """

    connections: int
    connections_of_client: int
    head_bytes: int
    head_time: float
    body_time: float
    write_time: float
    proxies: Sequence[IPv4Network | IPv6Network] = ()
    """Addresses that many clients share: only the limit in all counts for them."""
    open: Counter[str] = field(default_factory=Counter)
    """Number of open connections by client."""

    def refusal(self, peer: str) -> ServiceError | None:
        """Why one more connection is refused; None if it is not."""
        if self.open.total() > self.connections:
            return TooManyConnections()
        if self.open[peer] > self.connections_of_client and not self._is_proxy(peer):
            return TooManyConnectionsOfClient()
        return None

    def _is_proxy(self, peer: str) -> bool:
        try:
            return any(ip_address(peer) in network for network in self.proxies)
        except ValueError:  # a network of IPv6, or no address
            return False


class Connection(HttpToolsProtocol):
    """One connection of a client."""

    ceilings: ClassVar[Ceilings]

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Refuses the connection above a ceiling."""
        super().connection_made(transport)
        self._refused_at: float | None = None
        self._head_at: float | None = self.loop.time()
        self._body_at: float | None = None
        self._blocked_at: float | None = None
        self._closing_at: float | None = None
        self._unparsed = self._head = self._discarded = 0
        self._running: RequestResponseCycle | None = None
        self._peer = Client(self.client[0] if self.client else "unknown").name
        self.ceilings.open[self._peer] += 1
        refusal = self.ceilings.refusal(self._peer)
        if refusal is not None:
            # those that are being refused count, too: beyond as many again, nobody is told why
            if self.ceilings.open.total() > 2 * self.ceilings.connections:
                self._refused_at = self.loop.time()
                self.reset()
            else:
                self._refuse(refusal)

    def connection_lost(self, exc: Exception | None) -> None:
        """Frees the connection's place."""
        self.ceilings.open[self._peer] -= 1
        if not self.ceilings.open[self._peer]:
            del self.ceilings.open[self._peer]
        self.pipeline.clear()
        self._disconnect(self._unanswered)  # uvicorn tells the newest request only
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Feeds the parser, unless the connection is refused."""
        if self._refused_at is not None:
            self._discarded += len(data)
            if self._discarded > _MOST_DISCARDED:
                self.reset()
            return
        if self._head_at is None and self._body_at is None and self._unanswered is None:
            self._head_at = self.loop.time()  # empty lines before a head are part of it
        self._unparsed += len(data)
        self._unset_keepalive_if_required()
        self._feed(data)
        if self._head_at is None and self._body_at is None:
            self._unparsed = 0
        elif self._unparsed > self.ceilings.head_bytes:
            self._refuse(HeadTooLarge(self.ceilings.head_bytes))

    def _feed(self, data: bytes) -> None:
        """Has bytes parsed. What is no HTTP is refused.

        An offer to speak another protocol, as curl's `--http2` and Java's client make it, is passed over. The parser
        takes no body after it: the request is parsed again without the offer.
        """
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserError:
            self._refuse(MalformedHttp())
        except httptools.HttpParserUpgrade as offer:
            method, version = self.parser.get_method(), self.parser.get_http_version().encode()
            if self._refused_at is not None or method == b"CONNECT":
                self._refuse(MalformedHttp())
                return
            line = b"%s %s HTTP/%s" % (method, self.url, version)
            kept = [b"%s: %s" % each for each in self.headers if each[0] != b"upgrade"]
            self.parser = httptools.HttpRequestParser(self)
            self.parser.set_dangerous_leniencies(lenient_data_after_close=True)  # as uvicorn does
            self._feed(b"\r\n".join([line, *kept, b"", data[offer.args[0] :]]))

    def on_message_begin(self) -> None:
        """A head begins; that of a further request may come before the answer."""
        self._head = 0
        if self._head_at is None:
            self._head_at, self._unparsed = self.loop.time(), 0
        super().on_message_begin()

    def on_url(self, url: bytes) -> None:
        """Counts the bytes of the head."""
        self._head += len(url)
        super().on_url(url)

    def on_header(self, name: bytes, value: bytes) -> None:
        """Counts the bytes of the head, with `: ` and the end of the line; keeps none above the ceiling."""
        self._head += len(name) + len(value) + 4
        if self._head <= self.ceilings.head_bytes:
            super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """The head is complete, the body begins."""
        if self._head > self.ceilings.head_bytes:
            self._refuse(HeadTooLarge(self.ceilings.head_bytes))
        elif len(self.pipeline) >= _MOST_AHEAD:
            self._refuse(TooManyConnectionsOfClient())
        if self._refused_at is None and not self.parser.should_upgrade():
            self._head_at, self._body_at = None, self.loop.time()
            super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Passes a part of the body on. What comes after it, as trailers, has the ceiling of a head."""
        self._unparsed = 0
        if self._refused_at is None:
            super().on_body(body)

    def on_message_complete(self) -> None:
        """The request has been received."""
        if self._refused_at is None and not self.parser.should_upgrade():
            self._body_at = None
            super().on_message_complete()

    def pause_writing(self) -> None:
        """The client does not read as fast as it is answered."""
        self._blocked_at = self.loop.time()
        super().pause_writing()

    def resume_writing(self) -> None:
        """The client has read."""
        self._blocked_at = None
        super().resume_writing()

    def shutdown(self) -> None:
        """Refuses a request that is still being sent, and closes the connection after an answer that is on its way."""
        cycle = self._unanswered
        if self._body_at is not None and cycle is self.cycle and not cycle.response_started:
            self._refuse(ShuttingDown())
        else:
            super().shutdown()

    def reset(self) -> None:
        """Ends the connection at once. The kernel, too, throws away what was not read."""
        with contextlib.suppress(OSError):  # it has just ended by itself
            self.transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_LINGER)
        self.transport.abort()

    def check(self) -> None:
        """Ends the connection if its client takes too long for anything."""
        limits = self.ceilings
        if self.transport.is_closing() and self._closing_at is None:
            self._closing_at = self.loop.time()
        if (
            self._over(self._refused_at, _LINGER)
            or self._over(self._blocked_at, limits.write_time)
            or self._over(self._closing_at, limits.write_time)
        ):
            self.reset()
        elif self._refused_at is not None:
            pass
        elif self._over(self._head_at, limits.head_time):
            self._refuse(RequestTimeout(limits.head_time))
        elif self._over(self._body_at, limits.body_time + _BODY_SLACK):
            self._refuse(RequestTimeout(limits.body_time))

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: ASGI3Application) -> None:
        self._running = cycle
        super()._start_asgi_task(cycle, app)

    @staticmethod
    def _disconnect(cycle: RequestResponseCycle | None) -> None:
        """Tells a request that its client is gone."""
        if cycle is not None:
            cycle.disconnected = True
            cycle.message_event.set()

    @property
    def _unanswered(self) -> RequestResponseCycle | None:
        """The request that is being worked on. Further ones may wait behind it."""
        return None if self._running is None or self._running.response_complete else self._running

    def _over(self, began: float | None, time: float) -> bool:
        return began is not None and self.loop.time() - began >= time

    def _refuse(self, error: ServiceError) -> None:
        """Answers with a problem, unless an answer has begun, and ends the connection.

        Closed at once, the connection would be reset by what the client still sends, and it would not read the answer.
        """
        if self._refused_at is not None or self.transport.is_closing():
            return
        self._refused_at = self.loop.time()
        self._unset_keepalive_if_required()
        logger.info("refused", extra={"client": self._peer, "reason": type(error).__name__})
        cycle = self._unanswered
        if cycle is not None:
            self._disconnect(cycle)
            if cycle.response_started or self.pipeline:
                self.reset()
                return
        self.flow.resume_reading()
        self.transport.write(_response(error))
        self.transport.write_eof()


def _response(error: ServiceError) -> bytes:
    """A whole response with a problem, after which the connection is closed."""
    problem = problem_type(error)
    status = HTTPStatus(problem.model_fields["status"].default)
    request_id = str(uuid.uuid4())
    body = json_document(problem_content(error, request_id))
    headers: dict[str, Any] = {
        "Content-Type": PROBLEM_MEDIA_TYPE,
        "Content-Length": len(body),
        "X-Request-ID": request_id,
        "Connection": "close",
    }
    if problem.retry_after is not None:
        headers["Retry-After"] = problem.retry_after
    lines = [f"HTTP/1.1 {status} {status.phrase}", *(f"{name}: {value}" for name, value in headers.items()), "", ""]
    return "\r\n".join(lines).encode() + body
