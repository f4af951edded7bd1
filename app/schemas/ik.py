"""What `POST /ik` takes and answers."""

from __future__ import annotations

from app.schemas.common import Pose, Response, described, part
from app.schemas.scene import Carried, CellRequest

_Q = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]


class IKRequest(CellRequest):
    """A pose whose arm configurations are wanted."""

    pose: Pose = described(
        "Pose of the TCP in the robot's base frame.", None, {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]}
    )
    windings: bool = described(
        "Whether to also give solutions a full turn away, where the joint range allows.", None, True, default=True
    )
    payload: Carried | None = described(
        "What the flange carries, for collisions. Null: nothing.",
        None,
        {"shape": {"shape": "box", "size": [0.1, 0.1, 0.2]}},
        default=None,
    )


class Contact(Response):
    """The two bodies that are nearest to each other: links, `tool`, `payload`, or an obstacle by its name."""

    pair: list[str] = described("Their names.", None, ["table", "forearm"])
    distance: float = described(
        "Distance between them, less the obstacle's margin; below zero they overlap by that much.", "m", 0.12
    )


class IKSolution(Response):
    """One arm configuration that reaches the pose."""

    q: list[float] = described("Joint positions.", "rad", _Q)
    label: str = described(
        "Branch: shoulder/elbow/wrist, and the windings where there are any.", None, "left/up/no_flip"
    )
    limit_distance: float = described("Least distance of a joint from an end of its range.", "rad", 1.57)
    smallest_singular_value: float = described(
        "Of the Jacobian in metres and radians: near zero, the configuration is nearly singular.", "1", 0.12
    )
    collides: bool = described("Whether the arm hits itself or an obstacle there.", None, False)
    nearest: Contact = part("What is nearest to what, or deepest inside it.")


class IKResponse(Response):
    """Every solution within the joint range."""

    id: str = described(
        "The request's id, as in the `X-Request-ID` header.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    solutions: list[IKSolution] = part("Solutions, one entry each.")
