"""POST /ik."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.convert.arm import robot_named
from app.convert.ik import to_collision_arm, to_ik_response
from app.convert.pose import to_matrix
from app.engine.result import TaskResult
from app.http.handlers import result_response
from app.http.openapi import problem_responses
from app.schemas import errors as problems
from app.schemas.ik import IKRequest, IKResponse
from optimizer.collision.model import collision_model
from optimizer.kinematics.inverse import required_inverse_kinematics

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
    value. Of a pose that the arm holds in infinitely many configurations (wrist stretched), some, with the joints that
    are `free`. Also the nearest or colliding pair of bodies in each: links, tool, payload and obstacles."""
    robot = robot_named(body.robot)
    kinematics = required_inverse_kinematics(robot, "pose")
    solutions = kinematics.solve(to_matrix(body.pose), to_matrix(body.tcp), robot.limits, body.windings, "goal")
    contacts = collision_model(to_collision_arm(body, robot)).closest_pairs([solution.q for solution in solutions])
    answer = to_ik_response(body, request.state.id, robot, solutions, contacts, kinematics.complete)
    return result_response(TaskResult.of_json(answer))
