"""Between the schemas of POST /ik and the optimizer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from app.convert.fields import fields
from app.convert.scene import carried, to_scene, tool_parts
from app.schemas.ik import IKRequest
from models.robot import Robot
from optimizer.collision.model import ClosestPair
from optimizer.kinematics.inverse import IKSolution
from optimizer.problem.arm import Arm, Payload


def to_ik_response(
    request: IKRequest, request_id: str, solutions: Sequence[IKSolution], contacts: Sequence[ClosestPair]
) -> dict[str, Any]:
    """The answer of `POST /ik`."""
    return {
        "id": request_id,
        "robot": request.robot,
        "solutions": [
            {
                "label": str(solution.label),
                **fields(solution, "q", "limit_distance", "smallest_singular_value"),
                "collides": contact.distance < 0,
                "nearest": fields(contact, "pair", "distance"),
            }
            for solution, contact in zip(solutions, contacts, strict=True)
        ],
    }


def to_arm(request: IKRequest, robot: Robot) -> Arm:
    """The arm as collisions know it. Raises InvalidProblem, with the field named."""
    return Arm(
        robot=robot,
        tool=tool_parts(request.tool),
        payload=Payload(shape=None if request.payload is None else carried(request.payload.shape)),
        scene=to_scene(request.scene),
    )
