"""POST /ik."""

from __future__ import annotations

import orjson
from fastapi import APIRouter, Request, Response

from app.convert import to_ik_response
from app.convert_arm import robot_named
from app.convert_pose import to_matrix
from app.convert_scene import to_arm
from app.documentation import problem_responses
from app.schemas import problems
from app.schemas.ik import IKRequest, IKResponse
from optimizer.collision import collision_model
from optimizer.inverse_kinematics import inverse_kinematics_for

router = APIRouter(tags=["motion"])


@router.post(
    "/ik",
    summary="Every arm configuration that reaches a pose",
    response_model=IKResponse,
    responses=problem_responses(
        problems.Validation,
        problems.UnreachablePose,
        problems.SingularPose,
        problems.UnknownRobot,
        problems.BodyTooLarge,
    ),
)
def solve(request: Request, body: IKRequest) -> Response:
    """Every solution within the joint range, with its branch, its distance to the limits and its smallest singular
    value, and what the arm hits there, or is nearest to: itself, or what surrounds it."""
    robot = robot_named(body.robot)
    solutions = inverse_kinematics_for(robot).solve(
        to_matrix(body.pose), to_matrix(body.tcp), robot.limits, body.windings, "goal"
    )
    contacts = collision_model(to_arm(body, robot)).contacts([solution.q for solution in solutions])
    content = to_ik_response(body, request.state.id, solutions, contacts)
    return Response(orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY), media_type="application/json")
