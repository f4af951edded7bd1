"""POST /ik."""

from __future__ import annotations

import orjson
from fastapi import APIRouter, Request, Response

from app.convert import robot_named, to_ik_response, to_matrix
from app.documentation import problem_responses
from app.schemas import problems
from app.schemas.ik import IKRequest, IKResponse
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
    value."""
    robot = robot_named(body.robot)
    solutions = inverse_kinematics_for(robot).solve(
        to_matrix(body.pose), to_matrix(body.tcp), robot.limits, body.windings, "goal"
    )
    content = to_ik_response(body, request.state.id, solutions)
    return Response(orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY), media_type="application/json")
