"""Unusual clients of HTTP: without names or media types, with other protocols, for the
head alone.
"""

from __future__ import annotations

import json

import pytest
from starlette.requests import Request

from joulepath.app.http.weights import is_wanted
from tests.app.live import Server
from tests.app.raw import RawAnswer, answer_on, connected

WRONG = b'{"sart": {"q": [0, 0, 0, 0, 0, 0]}}'
EVENTS = "text/event-stream"
CSV = "text/csv"


def asked(server: Server, *parts: bytes) -> RawAnswer:
    with connected(server) as connection:
        for part in parts:
            connection.sendall(part)
        return answer_on(connection)


def lines(*given: str) -> bytes:
    return "\r\n".join([*given, "", ""]).encode()


@pytest.mark.parametrize("offer", ["h2c", "websocket", "TLS/1.0, HTTP/1.1"])
@pytest.mark.parametrize("cut", [0, 20, 1])
def test_a_body_is_read_although_the_client_offers_another_protocol(
    server: Server, offer: str, cut: int
) -> None:
    head = lines(
        "POST /optimize HTTP/1.1",
        "Host: localhost",
        f"Upgrade: {offer}",
        "Connection: Upgrade, HTTP2-Settings",
        "HTTP2-Settings: AAMAAABkAAQAAP__",
        f"Content-Length: {len(WRONG)}",
    )
    # in one piece, divided in the body, and divided in the head
    whole = head + WRONG
    at = {0: len(whole), 20: len(head) + 20, 1: len(head) // 2}[cut]
    assert "`sart`" in json.dumps(asked(server, whole[:at], whole[at:]).problem)


def test_offers_one_after_another_on_one_connection(server: Server) -> None:
    get = lines("GET /healthz HTTP/1.1", "Host: localhost", "Upgrade: h2c", "Connection: Upgrade")
    with connected(server) as connection:
        connection.sendall(3 * get + lines("GET /robots HTTP/1.1", "Host: localhost"))
        assert [answer_on(connection).status for _ in range(4)] == 4 * [200]
    assert asked(server, lines("CONNECT localhost:80 HTTP/1.1", "Host: localhost")).status == 404


@pytest.mark.parametrize(
    "path", ["/healthz", "/robots", "/robots/ur5e", "/studio", "/problems/busy", "/nowhere"]
)
def test_a_head_is_that_of_the_whole_answer(server: Server, path: str) -> None:
    whole = asked(server, lines(f"GET {path} HTTP/1.1", "Host: localhost"))
    with connected(server) as connection:
        connection.sendall(lines(f"HEAD {path} HTTP/1.1", "Host: localhost", "Connection: close"))
        with connection.makefile("rb") as stream:
            head, _, body = stream.read().partition(b"\r\n\r\n")
    assert body == b""
    first, *others = head.decode().lower().split("\r\n")
    assert first.split()[1] == str(whole.status)
    headers = dict(line.split(": ", 1) for line in others)
    assert headers["content-type"] == whole.headers["content-type"]
    assert headers["content-length"] == whole.headers["content-length"]


def test_the_head_of_a_stream_ends(server: Server) -> None:
    """The head ends although the job has not ended: no client waits for its body."""
    job = server.post(
        "/jobs", {"requests": [{"optimize": {"start": {"q": [0.0] * 6}, "goal": {"q": [0.1] * 6}}}]}
    )
    with connected(server) as connection:
        path = f"{job.headers['location']}/events"
        connection.sendall(lines(f"HEAD {path} HTTP/1.1", "Host: localhost"))
        connection.sendall(lines("GET /healthz HTTP/1.1", "Host: localhost"))
        with connection.makefile("rb") as stream:
            heads = [stream.readline()]
            while not heads[-1].startswith(b"HTTP/1.1 200") or len(heads) == 1:
                heads.append(stream.readline())
    assert any(EVENTS in line.decode() for line in heads)


def test_http_1_0_has_no_host(server: Server) -> None:
    post = lines("POST /optimize HTTP/1.0", f"Content-Length: {len(WRONG)}") + WRONG
    assert "`sart`" in json.dumps(asked(server, post).problem)
    assert (
        asked(server, lines("GET /robots HTTP/1.1", "Connection: close")).problem["type"]
        == "/problems/malformed-http"
    )


def test_the_target_of_a_client_behind_a_proxy(server: Server) -> None:
    """Its host counts, not the header's (RFC 9112, section 3.2.2)."""
    own, foreign = (
        asked(server, lines(f"GET {target} HTTP/1.1", f"Host: {header}"))
        for target, header in (
            ("HTTP://localhost:80/robots/ur5e%2Furdf?", "evil.example"),
            ("http://evil.example/robots", "localhost"),
        )
    )
    assert own.status == 200 and b"<robot" in own.body
    assert foreign.problem["type"] == "/problems/wrong-host"


@pytest.mark.parametrize("declared", ["", " ", ";charset=utf-8"])
def test_an_empty_content_type_is_none(server: Server, declared: str) -> None:
    head = (
        "POST /optimize HTTP/1.1",
        "Host: localhost",
        f"Content-Type: {declared}",
        f"Content-Length: {len(WRONG)}",
    )
    assert "`sart`" in json.dumps(asked(server, lines(*head) + WRONG).problem)


@pytest.mark.parametrize(
    ("accept", "media_type", "wanted"),
    [
        (EVENTS, EVENTS, True),
        ("TEXT/Event-Stream; q=0.5", EVENTS, True),
        ("application/json, text/event-stream", EVENTS, True),
        ("text/event-stream;q=0, application/json", EVENTS, False),
        ("application/json, text/event-stream;q=0.5", EVENTS, False),
        ("text/event-streamx", EVENTS, False),
        ("*/*", EVENTS, False),
        ("text/csv, */*;q=0.1", CSV, True),
        ("text/csv;q=abc", CSV, False),
        ("", CSV, False),
        (",;,", CSV, False),
    ],
)
def test_what_a_client_accepts(accept: str, media_type: str, wanted: bool) -> None:
    request = Request({"type": "http", "headers": [(b"accept", accept.encode())]})
    assert is_wanted(request, media_type) == wanted
