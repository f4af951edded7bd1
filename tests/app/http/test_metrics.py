"""GET /metrics: true numbers, and no label under the control of a client."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from prometheus_client.parser import text_string_to_metric_families
from starlette.testclient import TestClient

from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from tests.app.live import CLIENT, GRACE, LOCAL, Server, serving, until
from tests.app.recorded import recorded_workers
from tests.app.requests import long_search, move


@pytest.fixture(scope="module")
def service() -> Iterator[Server]:
    with serving(workers=1, queue_size=1, stop_grace=GRACE) as server:
        yield server


def samples(server: Server) -> dict[tuple[str, tuple[str, ...]], float]:
    """Value of each sample by its name and the values of its labels."""
    answer = server.get("/metrics")
    assert answer.status_code == 200 and answer.headers["content-type"].startswith("text/plain")
    families = text_string_to_metric_families(answer.text)
    return {
        (each.name, tuple(each.labels.values())): each.value
        for family in families
        for each in family.samples
    }


def value(server: Server, name: str, *labels: str) -> float:
    return samples(server).get((name, labels), 0.0)


REQUESTS = "joulepath_http_requests_total"


def test_requests_are_counted_by_route_method_and_status(service: Server) -> None:
    study = b'{"name": "n", "threshold": 1}'
    for label, send in {
        ("GET", "/robots/{name}", "200"): lambda: service.get("/robots/ur5e"),
        ("GET", "/robots/{name}", "404"): lambda: service.get("/robots/r2d2"),
        ("POST", "/optimize", "422"): lambda: service.post("/optimize", {}),
        ("DELETE", "/optimize", "405"): lambda: CLIENT.delete(service.url + "/optimize"),
        # a body without a type is declared JSON on the way
        ("POST", "/studies", "201"): lambda: CLIENT.post(service.url + "/studies", content=study),
    }.items():
        before = value(service, REQUESTS, *label)
        send()
        assert value(service, REQUESTS, *label) == before + 1, label


def test_durations_and_problems(service: Server) -> None:
    name = "joulepath_http_request_duration_seconds"
    before = samples(service)
    service.get("/studies/none")
    after = samples(service)

    def more(name: str, *labels: str) -> float:
        return after[name, labels] - before.get((name, labels), 0.0)

    assert more(f"{name}_count", "GET", "/studies/{id}") == 1
    assert 0 < more(f"{name}_sum", "GET", "/studies/{id}") < 60
    assert more("joulepath_problems_total", "unknown-study") == 1


def test_no_client_makes_labels(service: Server) -> None:
    service.get("/nothing/0"), service.get("/studies/0"), service.get("/problems/0")
    before = samples(service).keys()
    for k in range(1, 20):
        for path in (f"/nothing/{k}", f"/studies/{k}", f"/problems/{k}?x={k}"):
            CLIENT.get(service.url + path, headers={"X-Request-ID": str(k), "Host": f"127.0.0.{k}"})
    assert samples(service).keys() == before
    assert "/nothing" not in str(before)


def test_the_queue_the_workers_and_restarts(service: Server) -> None:
    names = ("joulepath_workers_busy", "joulepath_queue_length", "joulepath_worker_restarts_total")

    def now() -> tuple[float, ...]:
        found = samples(service)
        return tuple(found[name, ()] for name in names)

    busy, waiting, restarts = now()
    assert (busy, waiting) == (0, 0)
    assert value(service, "joulepath_workers_warm") == value(service, "joulepath_ready") == 1
    before = service.workers()
    with service.open("/optimize", long_search(60.0)):
        until(lambda: now() == (1, 0, restarts))
        with service.open("/optimize", long_search(60.0)):
            until(lambda: now() == (1, 1, restarts))
            until(lambda: value(service, "joulepath_queue_oldest_seconds") > 0)
            refused = service.post("/optimize", move())
            assert refused.status_code == 503
            assert value(service, "joulepath_problems_total", "busy") == 1
        until(lambda: now() == (1, 0, restarts))
    until(lambda: now() == (0, 0, restarts))
    assert service.workers() == before, "a worker whose client leaves stays"
    os.kill(before[0], signal.SIGKILL)
    until(lambda: now() == (0, 0, restarts + 1))


def test_the_database_and_the_process(service: Server) -> None:
    found = samples(service)
    assert found["joulepath_store_up", ()] == 1
    assert 20e6 < found["process_resident_memory_bytes", ()] < 2e9


def test_a_database_that_does_not_answer() -> None:
    settings = Settings(
        workers=1, robots=(), database_url="postgresql://tester:secret-word@127.0.0.1:1/postgres"
    )
    app = create_app(settings)
    with recorded_workers(), TestClient(app, base_url=LOCAL) as client:
        until(lambda: app.state.engine.ready)
        text = client.get("/metrics").text
        assert client.get("/readyz").status_code == 503
    assert "joulepath_store_up 0.0" in text
    assert "joulepath_ready 0.0" in text, "as /readyz says"


def test_the_format_of_openmetrics(service: Server) -> None:
    answer = CLIENT.get(
        service.url + "/metrics", headers={"Accept": "application/openmetrics-text; version=1.0.0"}
    )
    assert answer.headers["content-type"].startswith("application/openmetrics-text")
    assert answer.text.endswith("# EOF\n")
