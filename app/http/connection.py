"""Connections below HTTP: their number, and time limits of heads and of reading answers.

uvicorn's protocol on h11 bounds the size of a head and handles one request of a connection at a
time, but it waits without limit for a head and for a client which does not read its answer.
`Connection` stands between the protocol and the socket.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import struct
import sys
import uuid
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from joulepath.app.access.client import Client, address_of
from joulepath.app.engine.result import json_document
from joulepath.app.exceptions.base import ServiceError
from joulepath.app.exceptions.queue import TooManyConnections, TooManyConnectionsOfClient
from joulepath.app.exceptions.transport import HeadTooLarge, MalformedHttp, RequestTimeout
from joulepath.app.http.handlers import PROBLEM_MEDIA_TYPE
from joulepath.app.http.problems import problem_of
from joulepath.app.settings import Settings

logger = logging.getLogger("app.connection")

_RESET = struct.pack("ii", 1, 0)
"""Socket option to discard unread data at the close."""


@dataclass(frozen=True)
class Connections:
    """The open connections of a service, and their ceilings."""

    settings: Settings
    linger: float = 1.0
    """Time a refused client has to read the reason [s].

    Further bytes of the client are discarded; after an immediate close they would reset the
    connection.
    """
    most_discarded: int = 1 << 23
    """Bytes received from a refused client after which its connection is reset."""
    open: set[Connection] = field(default_factory=set)

    def refusal(self, connection: Connection) -> ServiceError | None:
        """The error for one connection too many; None within the ceilings."""
        if len(self.open) > self.settings.max_connections:
            return TooManyConnections()
        if (
            sum(each.peer == connection.peer for each in self.open)
            <= self.settings.client_connections
        ):
            return None
        address = address_of(connection.client.address)
        is_proxy = address is not None and any(
            address in network for network in self.settings.trusted_proxies
        )
        return None if is_proxy else TooManyConnectionsOfClient()

    def reset(self) -> None:
        """Ends all connections at once."""
        for connection in list(self.open):
            connection.reset()


class Connection(asyncio.Protocol):
    """One connection of a client.

    As a context manager it marks the time of a request, during which no head is awaited.

    Args:
        connections: all connections of the service.
        app_state: state of the application given by uvicorn; the state of a request is a copy of it
            with the connection.
        given: further arguments for uvicorn's protocol.
    """

    def __init__(self, connections: Connections, app_state: dict[str, Any], **given: Any) -> None:
        self._connections, self._settings = connections, connections.settings
        self.inner = H11Protocol(app_state={**app_state, "connection": self}, **given)
        self.is_refused = False
        self._in_hand = self._discarded = 0
        self._loop = asyncio.get_running_loop()
        self._until = self._read_until = self._loop.call_later(
            self._settings.head_timeout, self._miss_head
        )

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Refuses the connection above a ceiling."""
        self.transport = transport
        self.client = Client((transport.get_extra_info("peername") or ["unknown"])[0])
        self.peer = self.client.name
        self._connections.open.add(self)
        self.inner.connection_made(cast(asyncio.Transport, _Wire(self)))
        if refusal := self._connections.refusal(self):
            self.refuse(refusal)
        # Refused connections count as well. Above twice the limit, connections are reset without a
        # response.
        if len(self._connections.open) > 2 * self._settings.max_connections:
            self.reset()

    def connection_lost(self, exc: Exception | None) -> None:
        """Frees the connection's place."""
        self._connections.open.discard(self)
        self._until.cancel()
        self._read_until.cancel()
        if not self.is_refused:
            self.inner.connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Passes bytes on, unless the connection is refused."""
        if self.is_refused:
            self._discarded += len(data)
            if self._discarded > self._connections.most_discarded:
                self.reset()
            return
        try:
            self.inner.data_received(data)
        except h11.ProtocolError:  # of a body whose answer has begun
            self.reset()

    def pause_writing(self) -> None:
        """The client does not read as fast as it is answered."""
        self._read_until = self._loop.call_later(self._settings.write_timeout, self.reset)
        self.inner.pause_writing()

    def resume_writing(self) -> None:
        """The client has read."""
        self._read_until.cancel()
        self.inner.resume_writing()

    def __enter__(self) -> None:
        self._in_hand += 1
        self._until.cancel()

    def __exit__(self, *_: object) -> None:
        self._in_hand -= 1
        if not self._in_hand:
            # uvicorn closes idle connections earlier, but not after a part of a head.
            self._end_after(max(self._settings.head_timeout, self._settings.write_timeout))

    def refuse(self, error: ServiceError) -> None:
        """Answers with a problem, and ends the connection."""
        if self.is_refused or self.transport.is_closing():
            return
        logger.info("refused", extra={"client": self.peer, "reason": type(error).__name__})
        self.is_refused = True
        self._loop.call_soon(self.inner.connection_lost, None)
        self.transport.resume_reading()
        self.transport.write(_response(error))
        self.transport.write_eof()
        self._end_after(self._connections.linger)

    def close(self) -> None:
        """Closes the connection after the client has read everything, or after its time."""
        if not (self.is_refused or self.transport.is_closing()):
            self.transport.close()
            self._end_after(self._settings.write_timeout)

    def reset(self) -> None:
        """Ends the connection at once; the kernel discards unread data."""
        with contextlib.suppress(OSError):  # it has just ended by itself
            self.transport.get_extra_info("socket").setsockopt(
                socket.SOL_SOCKET, socket.SO_LINGER, _RESET
            )
        self.transport.abort()

    def _end_after(self, time: float) -> None:
        self._until.cancel()
        if self in self._connections.open:  # a request may end after its client has left
            self._until = self._loop.call_later(time, self.reset)

    def _miss_head(self) -> None:
        self.refuse(RequestTimeout(self._settings.head_timeout))


class _Wire:
    """The transport of a connection, as uvicorn's protocol has it."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.close = connection.close

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection.transport, name)

    def write(self, data: bytes) -> None:
        """Sends bytes. uvicorn's answer in plain text to a malformed request becomes a problem."""
        error = sys.exception()
        if isinstance(error, h11.RemoteProtocolError):
            is_large = error.error_status_hint == HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
            most = self._connection.inner.config.h11_max_incomplete_event_size or 0
            self._connection.refuse(HeadTooLarge(most) if is_large else MalformedHttp())
        elif not self._connection.is_refused:
            self._connection.transport.write(data)


def _response(error: ServiceError) -> bytes:
    """A complete response with a problem, followed by the close of the connection."""
    request_id, status = str(uuid.uuid4()), HTTPStatus(error.status)
    body = json_document(problem_of(error, request_id))
    lines = [
        f"HTTP/1.1 {status} {status.phrase}",
        f"Content-Type: {PROBLEM_MEDIA_TYPE}",
        f"Content-Length: {len(body)}",
        f"X-Request-ID: {request_id}",
        "Connection: close",
        *([] if error.retry_after is None else [f"Retry-After: {error.retry_after}"]),
    ]
    return "\r\n".join([*lines, "", ""]).encode() + body
