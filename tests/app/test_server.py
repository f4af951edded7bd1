"""`python -m joulepath.app` over a real socket: concurrency, overload, crashes, hang-ups, logs and
shutdown.
"""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any, TypeVar

import httpx2
import pytest

from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.exceptions.queue import Busy, ShuttingDown
from joulepath.app.exceptions.transport import BodyTooLarge, MalformedHttp
from joulepath.app.server import listen, told
from tests.app.live import (
    CLIENT,
    EXIT,
    GRACE,
    ROOT,
    WARM_UP,
    Server,
    alive,
    processor_time,
    serving,
    until,
)
from tests.app.problems import checked
from tests.app.requests import EXAMPLES, long_search, move

T = TypeVar("T")

# The longest that a busy machine takes for any step below [s]; no test waits for it to pass.
PATIENCE = 60.0
# A deadline out of reach of a busy machine within one test [s].
LONG = 30.0
# Processor time used only by a worker with a task [s].
AT_WORK = 0.1


def received(server: Server) -> int:
    """Number of requests to /optimize so far."""
    return sum(
        entry["message"] == "received" and entry["path"] == "/optimize" for entry in server.logged()
    )


def in_background(
    pool: ThreadPoolExecutor, server: Server, body: Any, count: int = 1
) -> list[Future[httpx2.Response]]:
    """Sends requests from threads and returns once the service has received them."""
    expected = received(server) + count
    futures = [pool.submit(server.post, "/optimize", body) for _ in range(count)]
    until(lambda: received(server) >= expected)
    return futures


def start_work(server: Server, start: Callable[[], T], workers: int) -> T:
    """Calls `start` and returns its result once so many idle workers are at work."""
    before = {pid: processor_time(pid) for pid in server.workers()}

    def at_work() -> int:
        return sum(processor_time(pid) > used + AT_WORK for pid, used in before.items())

    started = start()
    until(lambda: at_work() >= workers)
    return started


def until_replaced(server: Server, before: list[int], count: int) -> None:
    """Waits until `count` workers have been killed and warm workers have replaced them."""

    def replaced() -> bool:
        now = server.workers()
        return len(now) == len(before) and len(set(before) - set(now)) == count

    until(replaced)


def until_free(server: Server, before: list[int]) -> None:
    """Waits until the workers, the same as before, have ended their tasks."""
    until(server.is_idle)
    assert server.workers() == before


def test_answers(server: Server) -> None:
    answer = server.post("/optimize", EXAMPLES["joint_to_pose"])
    assert answer.status_code == 200
    model_of(OptimizeAnswer).model_validate_json(answer.content)


def test_the_page_for_newcomers_shows_what_its_script_prints(server: Server) -> None:
    page = (ROOT / "docs" / "start" / "first_saving.md").read_text()
    (request,) = re.findall(r"```json [^\n]+\n(\{.*?\})\n```", page, re.DOTALL)
    assert json.loads(request) == json.loads(
        (ROOT / "examples" / "optimize" / "pick_to_place.json").read_text()
    )
    assert "python3 first_saving.py pick_to_place.json http://127.0.0.1:8000\n```" in page
    command = ["python3", "examples/first_saving.py", "examples/optimize/pick_to_place.json"]
    run = subprocess.run(
        [*command, server.url], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert f"```text\n{run.stdout}```" in page


def test_long_requests_hold_up_nobody(server: Server) -> None:
    before = server.workers()
    with start_work(server, lambda: server.open("/optimize", long_search(LONG)), workers=1) as long:
        for _ in range(20):
            assert server.get("/healthz").status_code == 200
        assert server.post("/optimize", move()).status_code == 200
        assert not long.answered, "the other worker answered meanwhile"
    until_free(server, before)


def test_refuses_what_it_cannot_queue(server: Server) -> None:
    # 2 workers and 4 places in the queue
    before = server.workers()
    with ExitStack() as connections:
        requests = [
            connections.enter_context(server.open("/optimize", long_search(LONG))) for _ in range(8)
        ]
        until(lambda: sum(request.answered for request in requests) == 2)
        assert [request.status() for request in requests if request.answered] == [503, 503]
        answer = server.post("/optimize", move())
        checked(Busy, answer.content)
        assert int(answer.headers["retry-after"]) > 0
    until_free(server, before)
    assert server.post("/optimize", move()).status_code == 200, "whoever hangs up leaves the queue"


@pytest.mark.long
def test_a_crash_costs_no_answer(server: Server) -> None:
    before = server.workers()
    assert len(before) == 2
    with ThreadPoolExecutor() as pool:
        # two requests, one of them on the killed worker
        futures = start_work(
            server, lambda: in_background(pool, server, long_search(deadline=6), 2), workers=2
        )
        os.kill(before[0], signal.SIGKILL)
        answers = [future.result() for future in futures]
    assert [answer.status_code for answer in answers] == [200, 200], (
        "it begins again on another worker"
    )
    until_replaced(server, before, 1)
    assert server.post("/optimize", move()).status_code == 200


def test_hanging_up_frees_the_worker(server: Server) -> None:
    before = server.workers()
    headers = {"X-Request-ID": "gone"}
    with start_work(
        server, lambda: server.open("/optimize", long_search(LONG), **headers), workers=1
    ):
        assert before == server.workers()
    until(
        lambda: any(
            entry.get("request_id") == "gone" and entry.get("status") == 499
            for entry in server.logged()
        )
    )
    until_free(server, before)


def test_a_large_body_is_answered_before_it_is_sent(server: Server) -> None:
    answer = CLIENT.post(server.url + "/optimize", content=b" " * 20_000_000)
    assert answer.status_code == 413
    checked(BodyTooLarge, answer.content)


def test_logs_one_line_per_request(server: Server) -> None:
    server.post("/optimize", move(duration=-1), headers={"X-Request-ID": "logged-once"})

    def entries() -> list[dict[str, Any]]:
        return [
            entry
            for entry in server.logged()
            if entry.get("request_id") == "logged-once" and entry["level"] == "info"
        ]

    until(lambda: bool(entries()))
    (entry,) = entries()
    assert entry["time"].endswith("+00:00")
    assert (
        entry.items()
        >= {"level": "info", "method": "POST", "path": "/optimize", "status": 422}.items()
    )
    assert entry["duration"] > 0


@pytest.mark.parametrize(
    "garbage",
    [
        b"\x16\x03\x01 hello\r\n\r\n",
        b"GET /healthz HTTP/one\r\n\r\n",
        b"POST /optimize HTTP/1.1\r\nHost: x\r\nContent-Length: two\r\n\r\n",
        b"POST /optimize HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\nContent-Length: 3\r\n\r\n{}",
        b"GET /healthz HTTP/1.1\r\nHo st: x\r\n\r\n",
        b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n",
        b"GET /healthz HTTP/1.1\r\n\r\n",
    ],
)
def test_garbage_on_the_socket_is_answered_with_a_problem(server: Server, garbage: bytes) -> None:
    host, port = server.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=PATIENCE) as connection:
        connection.sendall(garbage)
        answer = b""
        while piece := connection.recv(4096):
            answer += piece
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400") and b"application/problem+json" in head
    checked(MalformedHttp, body)
    assert server.get("/healthz").status_code == 200


@pytest.mark.parametrize(
    ("settings", "deadline", "count", "statuses"),
    [
        # The request ends in its own time: a busy machine may find no motion in it.
        pytest.param(
            {"shutdown_grace": LONG, "deadline_grace": GRACE},
            1.0,
            1,
            {200, 504},
            id="ample",
            marks=pytest.mark.long,
        ),
        pytest.param({"shutdown_grace": 1.0}, LONG, 3, {503}, id="short"),
    ],
)
def test_sigterm_answers_or_refuses_all_in_flight(
    settings: dict[str, float], deadline: float, count: int, statuses: set[int]
) -> None:
    with (
        serving(workers=1, queue_size=4, **settings) as server,
        ThreadPoolExecutor(count) as pool,
    ):
        body = long_search(deadline)
        found = in_background(pool, server, body, count)
        until(lambda: found[0].done() or not server.is_idle())
        everyone = server.descendants()
        # a service manager signals every process
        for pid in everyone:
            os.kill(pid, signal.SIGTERM)
        assert server.terminate() == 0
        answers = [future.result() for future in found]
        assert {answer.status_code for answer in answers} <= statuses
        for answer in answers:
            if answer.status_code == 503:
                checked(ShuttingDown, answer.content)
                assert "retry-after" in answer.headers
        until(lambda: not any(alive(pid) for pid in everyone))
        with pytest.raises(httpx2.ConnectError):
            server.get("/healthz")


@pytest.mark.long
def test_sigterm_while_the_workers_warm_up(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with serving(warm=False, workers=1) as server:
        until(lambda: any(entry["message"] == "listening" for entry in server.logged()), WARM_UP)
        everyone = server.descendants()
        assert list(tmp_path.glob("pymp-*")), "the sockets between the processes"
        assert server.terminate() == 0
        until(lambda: not any(alive(pid) for pid in everyone))
    assert not list(tmp_path.glob("pymp-*"))


@pytest.mark.long
def test_ctrl_c_in_a_terminal_ends_cleanly() -> None:
    with serving(workers=1) as server, ThreadPoolExecutor() as pool:
        everyone = server.descendants()
        (future,) = in_background(pool, server, long_search(deadline=2))
        # a terminal signals the whole foreground group
        for pid in (*everyone, server.process.pid):
            os.kill(pid, signal.SIGINT)
        # The request ends in its own time: a busy machine may find no motion in it.
        assert future.result().status_code in (200, 504)
        assert server.process.wait(EXIT) == 0
        until(lambda: not any(alive(pid) for pid in everyone))
        assert not [entry for entry in server.logged() if entry["level"] == "error"]


@pytest.mark.long
def test_another_ctrl_c_ends_what_runs() -> None:
    """A second Ctrl+C leaves out the end of the lifespan, and the workers end by themselves."""
    with serving(workers=1) as server, ThreadPoolExecutor() as pool:
        everyone = server.descendants()
        start_work(server, lambda: in_background(pool, server, long_search(LONG)), workers=1)

        def ended() -> bool:
            server.process.send_signal(signal.SIGINT)
            return server.process.poll() is not None

        until(ended)
        assert server.process.wait(EXIT) == 0
        until(lambda: not any(alive(pid) for pid in everyone))


@pytest.mark.long
def test_workers_do_not_outlive_a_killed_parent() -> None:
    with serving(workers=1) as server, ThreadPoolExecutor() as pool:
        everyone = server.descendants()
        (future,) = start_work(
            server, lambda: in_background(pool, server, long_search(LONG)), workers=1
        )
        server.process.kill()
        until(lambda: not any(alive(pid) for pid in everyone))
        assert isinstance(future.exception(), httpx2.TransportError)


def test_a_terminal_is_told_where_the_service_is() -> None:
    with ExitStack() as opened:
        sockets = [opened.enter_context(each) for each in listen("127.0.0.1", 0)]
        port = sockets[0].getsockname()[1]
        assert told(sockets).startswith(f"joulepath is at http://127.0.0.1:{port}: the studio")
        if socket.has_ipv6:
            sockets += [opened.enter_context(each) for each in listen("::1", 0)]
            assert f"{port} and http://[::1]:" in told(sockets)
