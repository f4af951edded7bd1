"""GET /tools and GET /tools/{name}."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path

from joulepath.app.api.tools.models import ToolDetail, ToolList, ToolSummary
from joulepath.app.http.openapi import problem_responses
from joulepath.models.tools.registry import FIGURES, tool_figures, tool_names
from joulepath.models.trust import TRUST
from joulepath.optimizer.exceptions import UnknownTool

router = APIRouter(prefix="/tools", tags=["robots"])

Name = Annotated[
    str, Path(description="Name of the tool, from `GET /tools`.", examples=["robotiq_2f_85"])
]


@router.get("", summary="All tools", response_model=ToolList)
async def list_tools() -> ToolList:
    """Names and titles of the grippers for the field `tool` of requests."""
    return ToolList(
        tools=[ToolSummary(name=name, title=tool_figures(name)["title"]) for name in tool_names()]
    )


@router.get(
    "/{name}",
    summary="All figures of a tool",
    response_model=ToolDetail,
    responses=problem_responses(UnknownTool),
)
async def show_tool(name: Name) -> ToolDetail:
    """Mass, centre of mass, inertia, TCP and shape with sources and trust letters."""
    if name not in tool_names():
        raise UnknownTool(list(tool_names()))
    figures = tool_figures(name)
    return ToolDetail(
        name=name,
        title=figures["title"],
        trust=TRUST,
        **{each: figures[each] for each in FIGURES},
        hulls=figures.get("hulls"),
        hull_radius=figures.get("hull_radius"),
    )
