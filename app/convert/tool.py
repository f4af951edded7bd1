"""Conversion of the tool of a request, given by name or by shape, to the library's tool."""

from __future__ import annotations

from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import replace

import numpy as np

from joulepath.app.convert.pose import to_matrix
from joulepath.app.convert.scene import to_capsules
from joulepath.app.schemas import scene as asked
from joulepath.app.schemas.common import Pose
from joulepath.models.robot import Array
from joulepath.optimizer.context_value import assigned
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.scene import Attachment
from joulepath.optimizer.problem.tool import load_tool

_SHARE: ContextVar[float] = ContextVar("share of the mass of a tool", default=1.0)


def to_tool(tool: str | asked.Tool) -> tuple[Attachment, ...]:
    """The capsules of a tool, in the flange frame. Raises UnknownTool."""
    return load_tool(tool).shape if isinstance(tool, str) else tuple(to_capsules(tool))


def to_tcp(tcp: Pose | None, tool: str | asked.Tool | None = None) -> Array:
    """Pose of the TCP in the flange frame.

    Args:
        tcp: the given pose; None for the pose of a named tool, or else of the flange.
        tool: name or shape of the tool.

    Returns:
        The pose, shape (4, 4).

    Raises:
        UnknownTool: no tool has this name.
    """
    if tcp is not None:
        return to_matrix(tcp)
    return load_tool(tool).T_flange_tcp if isinstance(tool, str) else np.eye(4)


def with_tool(tool: str | asked.Tool, part: Payload) -> Payload:
    """Payload of the flange: the part and the body of a named tool. Raises UnknownTool."""
    if not isinstance(tool, str):
        return part
    named, share = load_tool(tool), _SHARE.get()
    body = replace(named.body, mass=share * named.body.mass, inertia=share * named.body.inertia)
    return replace(named, body=body).carrying(part)


def tool_of_mass(share: float) -> AbstractContextManager[None]:
    """Within the context, and its thread, tools with a name have this share of their mass."""
    return assigned(_SHARE, share)
