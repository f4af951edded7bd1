"""Bytes in flight over a real socket: bodies and answers without room, and clients that leave."""

from __future__ import annotations

import resource
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.api.shared import uploads
from joulepath.app.exceptions.queue import Busy, TooManyBytes, TooManyBytesOfClient, TooManyRequests
from joulepath.app.exceptions.transport import UploadNotStored
from joulepath.app.http.bytes_in_flight import BytesInFlight, Held
from tests.app.live import Server, serving, until
from tests.app.problems import checked
from tests.app.raw import RawAnswer, answer_on, connected, post

BODY = 1 << 20
OTHER = "127.0.0.2"
THIRD = "127.0.0.3"


@pytest.fixture(scope="module")
def tight() -> Iterator[Server]:
    """A server with room for three large bodies, two of them from one client."""
    room = {"max_bytes_in_flight": 3 * BODY + 100_000, "client_bytes_in_flight": 2 * BODY + 100_000}
    with serving(recorded=True, **room) as server:
        yield server


def begun(server: Server, stack: ExitStack, path: str, address: str) -> None:
    """A body whose first byte has reached the service; it keeps its place until the stack ends."""
    count = len(received(server, path))
    stack.enter_context(connected(server, address)).sendall(post(path, b"{", declared=BODY))
    until(lambda: len(received(server, path)) > count)


def received(server: Server, path: str) -> list[dict[str, Any]]:
    return [
        entry
        for entry in server.logged()
        if entry["message"] == "received" and entry["path"] == path
    ]


def left(server: Server, path: str) -> list[dict[str, Any]]:
    """Lines of the log about requests with departed clients."""
    return [
        entry for entry in server.logged() if entry.get("status") == 499 and entry["path"] == path
    ]


def asked(server: Server, address: str, request: bytes) -> RawAnswer:
    with connected(server, address) as connection:
        connection.sendall(request)
        return answer_on(connection)


@pytest.mark.parametrize("path", ["/optimize", "/evaluate", "/robots"])
def test_bodies_count_against_a_share_and_a_total(tight: Server, path: str) -> None:
    gone = len(left(tight, path))
    with ExitStack() as stack:
        for _ in range(2):
            begun(tight, stack, path, "127.0.0.1")
        refused = asked(tight, "127.0.0.1", post(path, b"{", declared=BODY))
        checked(TooManyRequests, refused.problem)
        assert int(refused.headers["retry-after"]) > 0
        begun(tight, stack, path, OTHER)
        checked(Busy, asked(tight, THIRD, post(path, b"{", declared=BODY)).problem)
        # small bodies still fit
        assert asked(tight, THIRD, post("/optimize", b"{}")).status == 422
        assert (
            asked(tight, THIRD, b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").status == 200
        )
        # an answer needs room, too
        large = b"GET /docs/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n"
        checked(TooManyRequests, asked(tight, "127.0.0.1", large).problem)
        checked(Busy, asked(tight, THIRD, large).problem)
    until(lambda: len(left(tight, path)) == gone + 3)
    assert asked(tight, "127.0.0.1", large).status == 200, "whoever leaves gives its bytes back"


def test_no_client_of_a_proxy_occupies_all_connections() -> None:
    def of(client: str, request: bytes) -> bytes:
        return request.replace(b"localhost", f"localhost\r\nX-Forwarded-For: {client}".encode())

    def has_received(server: Server, count: int) -> bool:
        return len(received(server, "/optimize")) >= count

    probe = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with serving(recorded=True, client_connections=3, trusted_proxies=OTHER) as server:
        with ExitStack() as stack:
            for count in range(1, 4):
                request = of("10.0.0.1", post("/optimize", b"{", declared=BODY))
                stack.enter_context(connected(server, OTHER)).sendall(request)
                until(partial(has_received, server, count))
            refused = asked(server, OTHER, of("10.0.0.1", probe))
            checked(TooManyRequests, refused.problem)
            assert "streams of events" in refused.problem["detail"]
            assert asked(server, OTHER, of("10.0.0.2", probe)).status == 200
        until(lambda: asked(server, OTHER, of("10.0.0.1", probe)).status == 200)


@pytest.mark.parametrize("path", ["/optimize", "/evaluate", "/studies/x/iterations"])
def test_leaving_during_an_upload_is_one_line_in_the_log(tight: Server, path: str) -> None:
    before = len(tight.logged())
    gone = len(left(tight, path))
    with ExitStack() as stack:
        begun(tight, stack, path, OTHER)
    until(lambda: len(left(tight, path)) > gone)
    lines = [entry for entry in tight.logged()[before:] if entry["level"] not in ("debug", "info")]
    assert not lines, "no traceback, no warning"
    assert len(left(tight, path)) == gone + 1


def test_a_killed_service_leaves_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with serving(recorded=True) as server, ExitStack() as stack:
        begun(server, stack, "/evaluate", OTHER)
        server.process.kill()
        server.process.wait()
        assert not [
            path
            for path in tmp_path.rglob("*")
            if path.is_file() and path.name.startswith("joulepath-")
        ]


@pytest.mark.parametrize("path", ["/evaluate", "/jobs"])
def test_a_body_without_space_is_a_problem(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    full = partial(Path("/dev/full").open, "r+b", 0)
    monkeypatch.setattr(uploads, "TemporaryFile", lambda **_: full())
    problem = client.post(path, json={})
    monkeypatch.undo()
    monkeypatch.setattr(tempfile, "tempdir", "/no/folder")
    other = client.post(path, json={})
    assert problem.json()["type"] == other.json()["type"] == "/problems/upload-not-stored"


def test_no_part_of_a_body_is_missing_on_a_full_disk() -> None:
    before, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    with uploads.upload() as (file, _):
        resource.setrlimit(resource.RLIMIT_FSIZE, (10, most))  # the file takes 10 bytes
        try:
            with pytest.raises(UploadNotStored):
                uploads.write(file, bytes(20))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (before, most))


def test_what_is_released_can_be_held_again() -> None:
    in_flight = BytesInFlight(most=100, most_of_client=60, small=0)
    with Held(in_flight, "a") as first:
        first.hold(60)
        with Held(in_flight, "a") as further, pytest.raises(TooManyBytesOfClient):
            further.hold(1)
        with Held(in_flight, "b") as other:
            with pytest.raises(TooManyBytes):
                other.hold(41)
            other.hold(40)
            other.hold(30)
            assert in_flight.held == {"a": 60, "b": 40}, "it is the most that it holds at a time"
    assert not in_flight.held, "names of clients do not pile up"
    with Held(in_flight, "a") as again:
        again.hold(60)


def test_small_ones_do_not_count() -> None:
    in_flight = BytesInFlight(most=1, most_of_client=1)
    with Held(in_flight, "a") as held:
        held.hold(in_flight.small)
        assert not in_flight.held
