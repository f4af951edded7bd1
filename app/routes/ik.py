"""POST /ik."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from app.convert.ik import to_collision_arm, to_ik_response
from app.convert.pose import to_matrix
from app.engine.result import TaskResult
from app.http.handlers import result_response
from app.http.json_route import JsonRoute
from app.http.openapi import problem_responses
from app.routes.dependencies import ServiceStore
from app.schemas import errors as problems
from app.schemas.ik import IKRequest, IKResponse
from app.tasks.arm_engine import robot_in
from models.robot import Robot
from optimizer.collision.model import collision_model
from optimizer.kinematics.inverse import required_inverse_kinematics

router = APIRouter(route_class=JsonRoute, tags=["motion"])


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
        problems.StoreUnavailable,
    ),
)
async def solve(request: Request, body: IKRequest, store: ServiceStore) -> Response:
    """Every solution within the joint range, with its branch, its distance to the limits and its smallest singular
    value. Of a pose that the arm holds in infinitely many configurations (wrist stretched), some, with the joints that
    are `free`. Also the nearest or colliding pair of bodies in each: links, tool, payload and obstacles."""
    robot = await robot_in(store, body.robot)
    return result_response(await run_in_threadpool(_answer, body, robot, request.state.id))


def _answer(body: IKRequest, robot: Robot, request_id: str) -> TaskResult:
    kinematics = required_inverse_kinematics(robot, "pose")
    solutions = kinematics.solve(to_matrix(body.pose), to_matrix(body.tcp), robot.limits, body.windings, "goal")
    contacts = collision_model(to_collision_arm(body, robot)).closest_pairs([solution.q for solution in solutions])
    return TaskResult.of_json(to_ik_response(body, request_id, robot, solutions, contacts, kinematics.complete))
