"""POST /ik: from its request to an arm, and from solutions to its answer."""

from __future__ import annotations

from typing import Any

from joulepath.app.convert.fields import fields
from joulepath.app.convert.pose import to_matrix
from joulepath.app.convert.scene import to_attachment, to_scene, to_tool
from joulepath.app.schemas.ik import IKRequest
from joulepath.models.robot import Robot
from joulepath.optimizer.inverse_kinematics import IKSolutions
from joulepath.optimizer.problem.arm import Arm, Payload


def to_ik_response(request: IKRequest, request_id: str, found: IKSolutions) -> dict[str, Any]:
    """The answer of `POST /ik`."""
    return {
        "request": request_id,
        "id": None,
        "robot": request.robot,
        "solutions": [
            {
                "label": str(solution.label),
                **fields(solution, "q", "limit_distance", "smallest_singular_value", "singular", "free", "collides"),
                "nearest": None if solution.nearest is None else fields(solution.nearest, "pair", "distance"),
            }
            for solution in found
        ],
        "complete": found.complete,
    }


def to_ik_arm(request: IKRequest, robot: Robot) -> Arm:
    """The arm with its TCP, and its shapes for collision checking. Raises InvalidProblem."""
    carried = request.payload
    return Arm(
        robot=robot,
        T_flange_tcp=to_matrix(request.tcp),
        tool=to_tool(request.tool),
        payload=Payload(shape=None if carried is None else to_attachment(carried.shape, carried.touches)),
        scene=to_scene(request.scene, robot),
    )
