"""Measurements in the formats of Prometheus. Every label has few values: no path, key or address is
one.
"""

from __future__ import annotations

from collections.abc import Iterator
from http import HTTPMethod

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector
from prometheus_client.exposition import choose_encoder
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from joulepath.app.engine.pool import Engine

_NO_ROUTE = "none"
_OTHER = "other"
_METHODS = frozenset(HTTPMethod)
# from requests without a worker up to the longest deadline [s]
_BUCKETS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0, 600.0)


class Metrics:
    """The measurements of one application."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._requests = Counter(
            "joulepath_http_requests",
            "Requests answered.",
            ["method", "route", "status"],
            registry=self._registry,
        )
        self._durations = Histogram(
            "joulepath_http_request_duration_seconds",
            "Time from the head of a request to the end of its answer.",
            ["method", "route"],
            buckets=_BUCKETS,
            registry=self._registry,
        )
        self._problems = Counter(
            "joulepath_problems",
            "Requests answered with a problem, by its type.",
            ["problem"],
            registry=self._registry,
        )
        ProcessCollector(registry=self._registry)

    def observe(
        self, method: str, route: str | None, status: int, problem: str | None, duration: float
    ) -> None:
        """Counts an answered request: `route` is the template of its path, `duration` in s."""
        method = method if method in _METHODS else _OTHER
        route = route or _NO_ROUTE
        self._requests.labels(method, route, str(status)).inc()
        self._durations.labels(method, route).observe(duration)
        if problem is not None:
            self._problems.labels(problem).inc()

    def document(
        self, accept: str, engine: Engine, ready: bool, store_up: bool
    ) -> tuple[bytes, str]:
        """All measurements in the format preferred by the header Accept, and its media type.
        `ready`: whether `/readyz` says so.
        """
        now = _Now(engine, ready, store_up)
        self._registry.register(now)
        try:
            encode, media_type = choose_encoder(accept)
            return encode(self._registry), media_type
        finally:
            self._registry.unregister(now)


class _Now(Collector):
    """Current values at the time of the request."""

    def __init__(self, engine: Engine, ready: bool, store_up: bool) -> None:
        self._engine, self._ready, self._store_up = engine, ready, store_up

    def collect(self) -> Iterator[Metric]:
        """One sample per value."""
        queue = self._engine.queue
        gauges = {
            "joulepath_queue_length": ("Requests that wait for a worker.", len(queue.waiting)),
            "joulepath_queue_oldest_seconds": (
                "Time for which the oldest waiting request has waited.",
                queue.oldest,
            ),
            "joulepath_workers_warm": (
                "Workers that run a request or could run one.",
                self._engine.warm_workers,
            ),
            "joulepath_workers_busy": ("Workers that run a request.", queue.busy),
            "joulepath_ready": ("Whether /readyz reports ready.", self._ready),
            "joulepath_store_up": ("Whether the database answers.", self._store_up),
        }
        for name, (text, value) in gauges.items():
            yield GaugeMetricFamily(name, text, value=float(value))
        yield CounterMetricFamily(
            "joulepath_worker_restarts", "Workers that were replaced.", value=self._engine.restarts
        )
