"""GET /healthz and GET /readyz."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter

from joulepath.app.api.shared.dependencies import ServiceEngine, ServiceStore
from joulepath.app.exceptions.queue import NotReady
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.common import Response, described

router = APIRouter(tags=["health"])


class Alive(Response):
    """The process is alive."""

    status: Literal["alive"] = described("Always `alive`.", None, "alive")


class Ready(Response):
    """All workers are warm: started, with the kernel loaded. The database can be read and
    written."""

    status: Literal["ready"] = described("Always `ready`.", None, "ready")
    workers: int = described("Number of warm workers.", "1", 2)


@router.get(
    "/healthz", summary="Is the process alive?", response_model=Alive, responses=problem_responses()
)
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
    """200 from the time when all workers are warm until the service stops, while the database can
    be read and written, and unless requests wait and no worker is at work."""
    if not engine.ready:
        raise NotReady
    if store.fault is not None:
        raise StoreUnavailable(store.fault)
    return Ready(status="ready", workers=engine.warm_workers)
