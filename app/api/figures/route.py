"""PUT /figures and GET /figures; GET and DELETE /figures/{id}."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import orjson
import yaml
from fastapi import APIRouter, Path, Request, Response
from fastapi.concurrency import run_in_threadpool

from joulepath.app.api.figures.models import FiguresDetail, FiguresList, FiguresSummary
from joulepath.app.api.figures.task import FiguresDocument, FiguresTask
from joulepath.app.api.shared.dependencies import ServiceClient, ServiceStore
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import LOCATION_HEADER, set_location
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.stored import (
    FiguresInUse,
    StoreUnavailable,
    TooManyFigures,
    UnknownFigures,
)
from joulepath.app.http.openapi import problem_responses
from joulepath.app.http.weights import is_wanted
from joulepath.app.schemas.examples.figures import FIGURES, UNKNOWN_ID
from joulepath.app.store import figures
from joulepath.app.store.store import Store
from joulepath.app.store.tables import Figures
from joulepath.app.tasks.arm_engine import robot_in
from joulepath.models.uncertainty.document import merged
from joulepath.optimizer.exceptions import UnknownRobot

router = APIRouter(prefix="/figures", tags=["robots"], route_class=LargeBodyRoute)

FiguresIdPath = Annotated[str, Path(description="Id of the figures.", examples=[UNKNOWN_ID])]
YAML = "application/yaml"


@router.put(
    "",
    summary="Store identified figures",
    response_model=FiguresDetail,
    responses={
        201: {"model": FiguresDetail, "description": "Stored", "headers": LOCATION_HEADER},
        **problem_responses(*WORKER_PROBLEMS, TooManyFigures),
    },
)
async def put_figures(
    request: Request,
    response: Response,
    body: FiguresDocument,
    tasks: ServiceTasks,
) -> FiguresDetail:
    """Stores figures identified on one arm, in the form of `GET /figures/{id}` of this or another
    server. The id follows from the content: the same figures are stored once.
    Their first owner keeps them."""
    result = await tasks.result(FiguresTask(body, tasks.request_id))
    new = figures.new_figures(body.robot, orjson.loads(result.document), tasks.client.owner)
    most = tasks.settings.max_figures
    row, is_new = await tasks.store.create(partial(figures.put, figures=new, most=most))
    if is_new:
        response.status_code = 201
    set_location(request, response, f"/figures/{row.id}")
    return await _detail(tasks.store, row)


@router.get(
    "",
    summary="All identified figures",
    response_model=FiguresList,
    responses=problem_responses(StoreUnavailable),
)
async def list_figures(store: ServiceStore) -> FiguresList:
    """Ids, robots and owners of all identified figures."""
    return FiguresList(
        figures=[FiguresSummary(**_summary(row)) for row in await store.read(figures.all_of)]
    )


@router.get(
    "/{id}",
    summary="Identified figures",
    response_model=FiguresDetail,
    responses={
        200: {
            "content": {
                YAML: {
                    "schema": {"type": "string"},
                    "example": yaml.safe_dump(FIGURES, sort_keys=False),
                }
            }
        },
        **problem_responses(UnknownFigures, UnknownRobot, StoreUnavailable),
    },
)
async def show_figures(request: Request, id: FiguresIdPath, store: ServiceStore) -> Any:
    """The robot's `figures.yaml` with the identified figures in the place of its own, their
    covariance and `sd`. `Accept: application/yaml` returns a file for `load_robot(name, figures=…)`
    of the library."""
    detail = await _detail(store, await store.read(partial(figures.get, id=id)))
    if not is_wanted(request, YAML):
        return detail
    content = detail.model_dump(
        mode="json", exclude={"id", "created", "owner", "parameters"}, exclude_none=True
    )
    return Response(await run_in_threadpool(_yaml, content), media_type=YAML)


@router.delete(
    "/{id}",
    summary="Delete identified figures",
    status_code=204,
    responses=problem_responses(UnknownFigures, FiguresInUse, NotOwner, StoreUnavailable),
)
async def delete_figures(id: FiguresIdPath, store: ServiceStore, client: ServiceClient) -> None:
    """Deletes figures not used by a study. Stored answers with these figures stay."""
    await store.write(partial(figures.delete, id=id, client=client), frees=True)


def _summary(row: Figures) -> dict[str, Any]:
    names = row.content.get("covariance", {}).get("names", [])
    return {
        "id": row.id,
        "robot": row.robot,
        "created": row.created,
        "owner": row.owner,
        "parameters": len(names),
    }


async def _detail(store: Store, row: Figures) -> FiguresDetail:
    """The whole document of a row. Raises UnknownRobot if its robot was deleted."""
    whole = merged((await robot_in(store, row.robot)).figures, row.content)
    sections: dict[str, Any] = {
        name: whole.get(name)
        for name in FiguresDetail.model_fields
        if name not in FiguresSummary.model_fields
    }
    return FiguresDetail(**_summary(row), **sections)


def _yaml(content: dict[str, Any]) -> str:
    text: str = yaml.safe_dump(
        content, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120
    )
    return text
