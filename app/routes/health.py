"""GET /healthz and GET /readyz."""

from __future__ import annotations

from fastapi import APIRouter

from app.exceptions import NotReady
from app.http.openapi import problem_responses
from app.routes.dependencies import ServiceEngine
from app.schemas import errors as problems
from app.schemas.health import Alive, Ready

router = APIRouter(tags=["health"])


@router.get("/healthz", summary="Is the process alive?", response_model=Alive, responses=problem_responses())
async def healthz() -> Alive:
    """Answers at once, also while the workers are busy."""
    return Alive(status="alive")


@router.get(
    "/readyz",
    summary="Are the workers warm?",
    response_model=Ready,
    responses=problem_responses(problems.NotReady),
)
async def readyz(engine: ServiceEngine) -> Ready:
    """200 from the time when all workers are warm until the service stops."""
    if not engine.ready:
        raise NotReady
    return Ready(status="ready", workers=engine.warm_workers)
