"""GET /tools and GET /tools/{name}."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Path

from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.common import Response, described, part
from joulepath.models.tools.registry import FIGURES, tool_figures, tool_names
from joulepath.models.trust import TRUST
from joulepath.optimizer.exceptions import UnknownTool

_SOURCE = "github.com/google-deepmind/mujoco_menagerie, robotiq_2f85/2f85.xml"


class ToolFigure(Response):
    """A figure of a tool, in the flange frame."""

    value: float | list[float] | list[list[float]] | list[list[list[float]]] = described(
        "Value of the figure.", None, 0.9
    )
    unit: str = described("Unit.", None, "kg")
    source: str = described("Source of the value; `none` with the letter E.", None, _SOURCE)
    trust: Literal["A", "B", "C", "E"] = described(
        "Quality of the source: see `trust` of the tool.", None, "C"
    )
    note: str = described("Remarks.", None, "Sum of the bodies; without an adapter plate.")


class ToolSummary(Response):
    """A tool."""

    name: str = described("Name in requests.", None, "robotiq_2f_85")
    title: str = described("Manufacturer and model.", None, "Robotiq 2F-85")


class ToolList(Response):
    """All tools."""

    tools: list[ToolSummary] = part("The tools.")


class ToolDetail(ToolSummary):
    """The figures of a tool with their sources and trust letters."""

    trust: dict[str, str] = described(
        "Meaning of the trust letters.", None, {"A": "published by the manufacturer"}
    )
    mass: ToolFigure = part("Mass.")
    center_of_mass: ToolFigure = part("Centre of mass: [x, y, z].")
    inertia: ToolFigure = part(
        "Inertia about the centre of mass, in the axes of the flange frame: [ixx, ixy, ixz, iyy, "
        "iyz, izz]."
    )
    tcp: ToolFigure = part("Pose of the TCP: [x, y, z, roll, pitch, yaw].")
    capsules: ToolFigure = part(
        "Shape for collision checking: capsules [x1, y1, z1, x2, y2, z2, radius], both ends of the "
        "axis."
    )
    hulls: ToolFigure | None = part(
        "Convex hulls that hold the tool more closely, and are compared with obstacles except "
        "clouds: points [x, y, z] of each, whose hull is grown by `hull_radius`; null for a tool "
        "without hulls."
    )
    hull_radius: ToolFigure | None = part("Grows the hulls; null for a tool without hulls.")


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
