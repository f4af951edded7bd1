"""POST /ik: from its request to an arm, and from solutions to its answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from joulepath.app.convert.fields import fields
from joulepath.app.convert.scene import to_attachment, to_scene, to_tool
from joulepath.app.schemas.ik import IKRequest
from joulepath.models.robot import Robot
from joulepath.optimizer.collision.model import ClosestPair
from joulepath.optimizer.kinematics.ik_solutions import IKSolution
from joulepath.optimizer.problem.arm import Arm, Payload


def to_ik_response(
    request: IKRequest,
    request_id: str,
    robot: Robot,
    solutions: Sequence[IKSolution],
    contacts: Sequence[ClosestPair],
    complete: bool,
) -> dict[str, Any]:
    """The answer of `POST /ik`."""
    return {
        "request": request_id,
        "id": None,
        "robot": request.robot,
        "solutions": [
            {
                "label": str(solution.label),
                **fields(solution, "q", "limit_distance", "smallest_singular_value", "singular"),
                "free": [robot.joint_names[j] for j in solution.self_motion.free] if solution.self_motion else [],
                "collides": contact.distance < 0,
                "nearest": fields(contact, "pair", "distance"),
            }
            for solution, contact in zip(solutions, contacts, strict=True)
        ],
        "complete": complete,
    }


def to_collision_arm(request: IKRequest, robot: Robot) -> Arm:
    """The arm with its shapes, for collision checking only. Raises InvalidProblem."""
    carried = request.payload
    return Arm(
        robot=robot,
        tool=to_tool(request.tool),
        payload=Payload(shape=None if carried is None else to_attachment(carried.shape, carried.touches)),
        scene=to_scene(request.scene, robot),
    )
