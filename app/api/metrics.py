"""GET /metrics."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request, Response

from joulepath.app.api.health import is_ready
from joulepath.app.api.shared.dependencies import ServiceEngine, ServiceMetrics, ServiceStore
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.store.store import Store

router = APIRouter(tags=["health"])

_PATIENCE = 2.0
"""Longest wait [s] for the database: Prometheus gives up after 10 s."""


@router.get(
    "/metrics",
    summary="Measurements for Prometheus",
    response_class=Response,
    responses={
        200: {"content": {"text/plain": {"schema": {"type": "string"}}}},
        **problem_responses(),
    },
)
async def metrics(
    request: Request, measured: ServiceMetrics, engine: ServiceEngine, store: ServiceStore
) -> Response:
    """Requests, durations, problems, the queue, the workers, the database and the process, in the
    text format of Prometheus."""
    store_up = await _answers(store)
    document, media_type = measured.document(
        request.headers.get("accept", ""), engine, is_ready(engine, store), store_up
    )
    return Response(document, media_type=media_type)


async def _answers(store: Store) -> bool:
    try:
        await asyncio.wait_for(store.read(lambda session: None), _PATIENCE)
    except (StoreUnavailable, TimeoutError):
        return False
    return True
