"""A tool of the library: its shape, its mass and its TCP in the flange frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.tools.registry import tool_figures, tool_names
from joulepath.optimizer.exceptions import UnknownTool
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.declared_types import check_type
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.scene import Attachment, Mesh, capsule_between


@dataclass(frozen=True, eq=False)
class Tool:
    """A gripper on the flange: an `Arm` takes `shape` as its `tool`, `T_flange_tcp`, and the
    payload of `carrying`.
    """

    name: str
    """Name in requests."""
    title: str
    """Manufacturer and model."""
    shape: tuple[Attachment, ...]
    """Capsules, and hulls if any, that represent the tool in the collision model."""
    body: Payload
    """Mass, centre of mass and inertia of the tool itself."""
    T_flange_tcp: Array
    """Pose of the TCP in the flange frame, shape (4, 4)."""
    figures: dict[str, Any]
    """The figures with their sources and trust letters."""

    def carrying(self, part: Payload | None = None) -> Payload:
        """The tool and a held part, as one rigid body.

        Args:
            part: the part, in the flange frame; None for the empty tool.

        Returns:
            The body with the sum of the masses; its shape for collisions is the shape of the part.
        """
        if part is None or part.mass == 0:
            shape = None if part is None else part.shape
            return Payload(self.body.mass, self.body.com, self.body.inertia, shape)
        mass = self.body.mass + part.mass
        com = (self.body.mass * self.body.com + part.mass * part.com) / mass
        inertia = sum(
            (each.inertia + _about(each.mass, each.com - com) for each in (self.body, part)),
            np.zeros((3, 3)),
        )
        return Payload(mass, com, inertia, part.shape)


def _about(mass: float, offset: Array) -> Array:
    """Inertia (3, 3) of a point mass [kg] at an offset (3,) [m] from an axis through the origin."""
    return np.asarray(mass * (offset @ offset * np.eye(3) - np.outer(offset, offset)))


def load_tool(name: str) -> Tool:
    """Load a gripper of the library.

    Args:
        name: one of `tool_names()`.

    Returns:
        The tool, with its figures.

    Raises:
        UnknownTool: no tool has this name.
        InvalidProblem: the name is no text.
    """
    check_type("name", name, str)
    if name not in tool_names():
        raise UnknownTool(list(tool_names()))
    return _tool(name)


@cache
def _tool(name: str) -> Tool:
    """The tool of a name in the library."""
    figures = tool_figures(name)
    value = {key: figure["value"] for key, figure in figures.items() if key != "title"}
    ixx, ixy, ixz, iyy, iyz, izz = value["inertia"]
    return Tool(
        name=name,
        title=figures["title"],
        shape=(
            *(
                capsule_between(np.array(row[:3]), np.array(row[3:6]), row[6], None)
                for row in value["capsules"]
            ),
            *(
                Attachment(Mesh(np.array(points), value["hull_radius"]), is_hull=True)
                for points in value.get("hulls", ())
            ),
        ),
        body=Payload(
            value["mass"],
            np.array(value["center_of_mass"]),
            np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]),
        ),
        T_flange_tcp=Pose.from_rpy(value["tcp"][:3], value["tcp"][3:]).T,
        figures=figures,
    )
