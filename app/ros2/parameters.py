"""Parameters of the node."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Self

import yaml
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from joulepath.app.ros2.messages import Json, refusal
from joulepath.models.own_arm.description import Description

FROM_MESSAGES = ("robot", "start", "goal", "deadline", "objective")
"""Fields of `POST /optimize` that are no part of the file `request`."""


def _parameter(default: Any, text: str) -> Any:
    return field(default=default, metadata={"text": text})


@dataclass(frozen=True)
class Parameters:
    """The values of all parameters when the node starts; they are read-only."""

    robot: str = _parameter("", "Name of the robot; empty: the arm on robot_description.")
    url: str = _parameter("", "Address of a service that computes; empty: this process.")
    api_key: str = _parameter("", "API key of that service.")
    prefix: str = _parameter("", "Prefix of all joint names and frames, such as left_.")
    base_frame: str = _parameter("base_link", "Frame of the robot's base link.")
    objective: str = _parameter("electrical", "Energy to minimise: electrical or mechanical.")
    deadline: float = _parameter(10.0, "Longest time of a plan [s].")
    request_file: str = _parameter(
        "", "YAML or JSON file with further fields of POST /optimize: payload, tool, scene, limits."
    )
    tip_link: str = _parameter("tool0", "Link at the end of the arm.")
    rated_payload: float = _parameter(0.0, "With robot_description: greatest payload [kg].")
    acceleration: float = _parameter(
        0.0, "With robot_description: limit of all joints [rad/s²]; 0: those of the URDF."
    )

    @classmethod
    def declared(cls, node: Node) -> Self:
        """Declare the parameters of a node, and read their values.

        Raises:
            InvalidRequest: the values contradict each other.
        """
        found = {
            each.name: node.declare_parameter(
                each.name,
                each.default,
                ParameterDescriptor(description=each.metadata["text"], read_only=True),
            ).value
            for each in fields(cls)
        }
        if found["url"] and not found["robot"]:
            raise refusal(
                ("url",), "A service computes for a robot that it has: set the parameter `robot`."
            )
        own = cls(**found)
        # reports an unusable file at the start of the node
        own.request()
        return own

    def request(self) -> Json:
        """Fields of `POST /optimize` common to all plans.

        Raises:
            InvalidRequest: the file cannot be used.
        """
        fixed = {"objective": self.objective, "deadline": self.deadline}
        return fixed | (_content(Path(self.request_file)) if self.request_file else {})

    def description(self, urdf: str) -> Description:
        """The description of the arm in a URDF."""
        return Description(
            urdf=urdf,
            tip=self.tip_link,
            payload=self.rated_payload,
            acceleration=self.acceleration or None,
            locked="others",
        )


def _content(path: Path) -> Json:
    """The fields in a file. Raises InvalidRequest."""
    try:
        found = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise refusal(("request_file",), f"{path} cannot be read: {error}") from None
    if not isinstance(found, dict):
        raise refusal(("request_file",), f"{path} has no fields: write one object.")
    taken = next((name for name in FROM_MESSAGES if name in found), None)
    if taken is not None:
        raise refusal(
            ("request_file", taken), f"`{taken}` comes from messages and parameters: delete it."
        )
    return found
