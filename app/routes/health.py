"""GET /healthz and GET /readyz."""

from __future__ import annotations

from fastapi import APIRouter, Request

from app.engine.pool import Engine
from app.exceptions import NotReady
from app.http.openapi import problem_responses
from app.schemas import errors as problems
from app.schemas.health import Alive, Ready

router = APIRouter(tags=["health"])


@router.get("/healthz", summary="Is the process alive?", response_model=Alive, responses=problem_responses())
async def healthz() -> Alive:
    """Answers at once, whatever the workers are at."""
    return Alive(status="alive")


@router.get(
    "/readyz",
    summary="Are the workers warm?",
    response_model=Ready,
    responses=problem_responses(problems.NotReady),
)
async def readyz(request: Request) -> Ready:
    """200 once every worker has warmed up, and until the service stops."""
    engine: Engine = request.app.state.engine
    if not engine.ready:
        raise NotReady
    return Ready(status="ready", workers=engine.warm_workers)
