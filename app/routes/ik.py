"""POST /ik."""

from __future__ import annotations

import orjson
from fastapi import APIRouter, Request, Response

from app.convert.arm import robot_named
from app.convert.ik import to_collision_arm, to_ik_response
from app.convert.pose import to_matrix
from app.http.openapi import problem_responses
from app.schemas import errors as problems
from app.schemas.ik import IKRequest, IKResponse
from optimizer.collision.model import collision_model
from optimizer.kinematics.inverse import inverse_kinematics_for

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
    contacts = collision_model(to_collision_arm(body, robot)).contacts([solution.q for solution in solutions])
    content = to_ik_response(body, request.state.id, solutions, contacts)
    return Response(orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY), media_type="application/json")
