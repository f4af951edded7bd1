"""Ceilings of connections over a real socket: heads, bodies, unread answers, and their number."""

from __future__ import annotations

import asyncio
import inspect
import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any
from unittest.mock import Mock

import h11
import pytest
from starlette.types import Receive, Scope, Send
from uvicorn import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from joulepath.app.exceptions.queue import Busy, ShuttingDown, TooManyRequests
from joulepath.app.exceptions.transport import HeadTooLarge, MalformedHttp, RequestTimeout
from tests.app.live import EXIT, Server, serving, until
from tests.app.problems import checked
from tests.app.raw import answer_on, connected, ends, is_reset, post
from tests.selection import long_but

MOST_HEAD = 4096
MOST = 12
MOST_OF_CLIENT = 8
OTHER = "127.0.0.2"
THIRD = "127.0.0.3"
SHORT = 0.5
"""Times that clients have [s]. Whoever keeps them sends at once; no test waits for one to pass, but
for its effect.
"""
GET = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
LARGE = b"GET /docs/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n"
"""Its answer is a megabyte that takes no time to make."""


@pytest.fixture(scope="module")
def strict() -> Iterator[Server]:
    """A server with low ceilings."""
    limits = {
        "max_head_bytes": MOST_HEAD,
        "max_connections": MOST,
        "client_connections": MOST_OF_CLIENT,
    }
    times = {"head_timeout": SHORT, "body_timeout": SHORT, "write_timeout": SHORT}
    with serving(recorded=True, **limits, **times) as server:
        yield server


@pytest.fixture(autouse=True)
def _nobody_is_connected(strict: Server) -> None:
    """The connections of the test before are gone, so the largest number of clients can connect."""

    def all_fit() -> bool:
        with ExitStack() as stack:
            connections = [stack.enter_context(connected(strict)) for _ in range(MOST_OF_CLIENT)]
            for connection in connections:
                connection.sendall(GET)
            return all(answer_on(connection).status == 200 for connection in connections)

    until(all_fit)


@pytest.mark.parametrize(
    "head",
    [
        b"GET /healthz HTTP/1.1\r\nX: " + b"a" * (MOST_HEAD + 1),
        b"GET /healthz HTTP/1.1\r\n" + b"X: y\r\n" * MOST_HEAD,
        b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * MOST_HEAD + b"\r\n\r\n",
        b"GET /" + b"a" * MOST_HEAD + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
        GET + b"GET /healthz HTTP/1.1\r\nX: " + b"a" * 300_000,
    ],
    ids=["one line", "many lines", "complete", "path", "after another request"],
)
def test_a_large_head_is_refused(strict: Server, head: bytes) -> None:
    with connected(strict) as connection:
        connection.sendall(head)
        answer = answer_on(connection)
        if head.startswith(GET) and answer.status == 200:
            answer = answer_on(connection)
        checked(HeadTooLarge, answer.problem)
        assert str(MOST_HEAD) in answer.problem["detail"]
        assert ends(connection)


def test_large_trailers_are_refused(strict: Server) -> None:
    head = b"POST /optimize HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
    with connected(strict) as connection:
        connection.sendall(head + b"1\r\n{\r\n0\r\n")
        until(lambda: any(entry.get("path") == "/optimize" for entry in strict.logged()))
        connection.sendall(b"X: " + b"a" * 2 * MOST_HEAD)
        checked(HeadTooLarge, answer_on(connection).problem)


def test_a_head_of_the_largest_size_is_taken(strict: Server) -> None:
    with connected(strict) as connection:
        value = b"a" * (MOST_HEAD - len("/healthz") - len("Host: localhost\r\n") - len("X: \r\n"))
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: " + value + b"\r\n\r\n")
        assert answer_on(connection).status == 200


@pytest.mark.parametrize("sent", [b"", b"G", b"GET / HTTP/1.1\r\nX: y\r\n"])
def test_half_a_head_is_not_waited_for(strict: Server, sent: bytes) -> None:
    with connected(strict) as connection:
        connection.sendall(sent)
        checked(RequestTimeout, answer_on(connection).problem)
        assert ends(connection)


def test_half_a_head_after_an_answer_is_not_waited_for(strict: Server) -> None:
    with connected(strict) as connection:
        connection.sendall(GET + b"GET /h")
        assert answer_on(connection).status == 200
        connection.sendall(b"ea")
        assert is_reset(connection)


@pytest.mark.parametrize("path", long_but(["/optimize"], ["/optimize", "/evaluate", "/robots"]))
def test_half_a_body_is_not_waited_for(strict: Server, path: str) -> None:
    with connected(strict) as connection:
        connection.sendall(post(path, b"{", declared=1000))
        checked(RequestTimeout, answer_on(connection).problem)
        assert ends(connection)
    assert strict.request_logged(path)["status"] == 408


def test_a_client_that_has_left_is_not_timed(strict: Server) -> None:
    """Its request ends later than its connection, so a timeout would reset nothing."""
    for _ in range(MOST_OF_CLIENT):
        with connected(strict) as leaving:
            leaving.sendall(post("/evaluate", b"{", declared=1000))
    # A later client has as much time, and learns of its end.
    with connected(strict) as later:
        checked(RequestTimeout, answer_on(later).problem)
        assert ends(later)
    assert not [entry for entry in strict.logged() if entry["level"] == "error"]


def test_a_body_that_nobody_reads_is_not_waited_for(strict: Server) -> None:
    with connected(strict) as connection:
        connection.sendall(post("/nowhere", b"{", declared=1000))
        assert answer_on(connection).status == 404
        assert ends(connection)


@pytest.mark.parametrize("is_answered", [False, True])
def test_a_malformed_body_ends_the_connection(strict: Server, is_answered: bool) -> None:
    path = "/nowhere" if is_answered else "/optimize"
    head = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n".encode()
    with connected(strict) as connection:
        connection.sendall(head + b"1\r\n{\r\n")
        if is_answered:
            assert answer_on(connection).status == 404
            connection.sendall(b"no chunk\r\n")
            assert is_reset(connection)
        else:
            connection.sendall(b"no chunk\r\n")
            checked(MalformedHttp, answer_on(connection).problem)
            assert ends(connection)
    assert not [entry for entry in strict.logged() if entry["level"] == "error"]


def test_an_answer_that_is_not_read_is_thrown_away(strict: Server) -> None:
    with connected(strict, receive_buffer=4096) as connection:
        # more than the buffers of both sockets hold
        connection.sendall(LARGE * 16)
        assert is_reset(connection)


def test_requests_far_ahead_of_their_answers_are_refused(strict: Server) -> None:
    with connected(strict) as connection:
        connection.sendall(GET * 1000)
        assert ends(connection)
    assert strict.get("/healthz").status_code == 200


def test_uvicorn_has_what_a_connection_needs() -> None:
    """The arguments of its protocol, the state of a request, and h11's error while it answers a
    malformed request.
    """
    assert list(inspect.signature(H11Protocol).parameters) == [
        "config",
        "server_state",
        "app_state",
        "_loop",
    ]
    states: list[Any] = []
    written: list[BaseException | None] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        states.append(scope["state"])
        await send({"type": "http.response.start", "status": 204})
        await send({"type": "http.response.body"})

    async def run() -> None:
        transport = Mock(asyncio.Transport, is_closing=lambda: False, get_extra_info=lambda _: None)
        transport.write = lambda _: written.append(sys.exception())
        config = Config(app, lifespan="off", log_config=None)
        protocol = H11Protocol(
            config=config, server_state=ServerState(), app_state={"connection": 1}
        )
        protocol.connection_made(transport)
        protocol.data_received(GET)
        await asyncio.gather(*protocol.tasks)
        assert states == [{"connection": 1}] and set(written) == {None}
        written.clear()
        protocol.data_received(b"GET /" + b"x" * 100_000)
        assert [
            each.error_status_hint for each in written if isinstance(each, h11.RemoteProtocolError)
        ][:1] == [431]

    asyncio.run(run())


def test_one_client_has_its_share_of_connections(strict: Server) -> None:
    with ExitStack() as stack:
        own = [stack.enter_context(connected(strict)) for _ in range(MOST_OF_CLIENT)]
        with connected(strict) as further:
            answer = answer_on(further)
            checked(TooManyRequests, answer.problem)
            assert int(answer.headers["retry-after"]) > 0
        others = [
            stack.enter_context(connected(strict, OTHER)) for _ in range(MOST - MOST_OF_CLIENT)
        ]
        for connection in (*own, *others):
            connection.sendall(GET)
            assert answer_on(connection).status == 200
        with connected(strict, THIRD) as further:
            checked(Busy, answer_on(further).problem)


def test_sigterm_waits_for_no_client() -> None:
    # The grace exceeds the wait of the test, so the service has to end open connections before it.
    with (
        serving(recorded=True, shutdown_grace=10 * EXIT, write_timeout=SHORT) as server,
        connected(server) as half_a_head,
        connected(server) as upload,
        connected(server) as body,
        connected(server, receive_buffer=4096) as unread,
    ):
        half_a_head.sendall(b"GET /heal")
        upload.sendall(post("/evaluate", b"{", declared=1000))
        body.sendall(post("/optimize", b"{", declared=1000))
        unread.sendall(LARGE * 16)
        until(
            lambda: (
                sum(entry["message"] == "received" for entry in server.logged() if "path" in entry)
                >= 3
            )
        )
        server.process.send_signal(signal.SIGTERM)
        for connection in (upload, body):
            checked(ShuttingDown, answer_on(connection).problem)
        assert server.process.wait(EXIT) == 0
        assert not [entry for entry in server.logged() if entry["level"] == "error"]
