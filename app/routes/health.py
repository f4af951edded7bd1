"""GET /healthz and GET /readyz."""

from __future__ import annotations

from fastapi import APIRouter

from joulepath.app.exceptions.queue import NotReady
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.routes.dependencies import ServiceEngine, ServiceStore
from joulepath.app.schemas.health import Alive, Ready

router = APIRouter(tags=["health"])


@router.get("/healthz", summary="Is the process alive?", response_model=Alive, responses=problem_responses())
async def healthz() -> Alive:
    """Answers at once, also while the workers are busy."""
    return Alive(status="alive")


@router.get(
    "/readyz",
    summary="Are the workers warm, and is the database there?",
    response_model=Ready,
    responses=problem_responses(NotReady, StoreUnavailable),
)
async def readyz(engine: ServiceEngine, store: ServiceStore) -> Ready:
    """200 from the time when all workers are warm until the service stops, while the database can be read and written,
    and unless requests wait and no worker is at work."""
    if not engine.ready:
        raise NotReady
    if store.fault is not None:
        raise StoreUnavailable(store.fault)
    return Ready(status="ready", workers=engine.warm_workers)
