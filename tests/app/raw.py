"""Raw sockets to a service, for requests sent and answers left unread by no HTTP client."""

from __future__ import annotations

import select
import socket
import time
from dataclasses import dataclass
from typing import Any

import orjson

from tests.app.live import ANSWER, Server


@dataclass(frozen=True)
class RawAnswer:
    """A response; after `end` the connection was closed."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def problem(self) -> dict[str, Any]:
        """The content, parsed as a problem."""
        assert self.headers["content-type"] == "application/problem+json"
        content: dict[str, Any] = orjson.loads(self.body)
        assert content["status"] == self.status
        return content


def connected(
    server: Server, address: str = "127.0.0.1", receive_buffer: int | None = None
) -> socket.socket:
    """A connection from a loopback address."""
    host, port = server.url.removeprefix("http://").split(":")
    connection = socket.socket()
    connection.settimeout(ANSWER)
    if receive_buffer is not None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    connection.bind((address, 0))
    connection.connect((host, int(port)))
    return connection


def post(
    path: str, body: bytes = b"", declared: int | None = None, kind: str = "application/json"
) -> bytes:
    """A request; its declared size may exceed the size of its body."""
    size = len(body) if declared is None else declared
    head = (
        f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: {kind}\r\nContent-Length: "
        f"{size}\r\n"
    )
    return f"{head}Cache-Control: no-cache\r\n\r\n".encode() + body


def answer_on(connection: socket.socket) -> RawAnswer:
    """The next response; bytes after it are left for the next call."""
    with connection.makefile("rb", buffering=0) as stream:
        status = int(stream.readline().split()[1])
        lines = iter(lambda: stream.readline().strip().decode(), "")
        headers = {
            name.lower(): value.strip()
            for name, _, value in (line.partition(":") for line in lines)
        }
        body = b""
        while len(body) < int(headers["content-length"]):
            body += stream.read(int(headers["content-length"]) - len(body)) or b""
        return RawAnswer(status, headers, body)


def ends(connection: socket.socket) -> bool:
    """Waits until the service closes the connection, and discards everything received
    until then.
    """
    try:
        while connection.recv(1 << 16):
            pass
    except ConnectionError:
        pass
    except TimeoutError:
        return False
    return True


def is_reset(connection: socket.socket) -> bool:
    """Waits until the service resets the connection; reads nothing."""
    poll = select.poll()
    poll.register(connection, select.POLLERR | select.POLLHUP)
    end = time.monotonic() + ANSWER
    while time.monotonic() < end:
        if poll.poll(100):
            return True
    return False
