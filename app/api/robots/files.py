"""GET /robots/{name}/urdf, mjcf, joint_limits and meshes.glb."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from joulepath.app.api.robots.joint_limits import MEDIA_TYPE as YAML
from joulepath.app.api.robots.joint_limits import JointLimitsQuery, JointLimitsTask
from joulepath.app.api.robots.mjcf import MjcfTask
from joulepath.app.api.robots.pictures import MEDIA_TYPE, PictureTask, digest, kept
from joulepath.app.api.shared.dependencies import ServiceStore
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.queue import ShuttingDown, WorkerLost
from joulepath.app.exceptions.stored import NoMeshes, StoreUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.http.weights import is_known
from joulepath.app.store import robots
from joulepath.models.registry import robot_names
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.exceptions import DeadlineExceeded, UnknownRobot
from joulepath.optimizer.joint_limits.errors import NoJointLimits
from joulepath.optimizer.problem.robots import load_robot

router = APIRouter(prefix="/robots", tags=["robots"])

Name = Annotated[str, Path(description="Name of the robot, from `GET /robots`.", examples=["ur5e"])]


@router.get(
    "/{name}/urdf",
    summary="The URDF of a robot",
    response_class=Response,
    responses={
        200: {
            "content": {"application/xml": {"schema": {"type": "string"}}},
            "description": "The URDF",
        },
        **problem_responses(UnknownRobot, StoreUnavailable),
    },
)
async def robot_urdf(name: Name, store: ServiceStore) -> Response:
    """The chain of joints from `base` to `flange`, with masses, inertias and limits, without
    meshes.
    """
    figures = load_robot(name).figures if name in robot_names() else None
    if figures is None:
        figures = (await store.read(partial(robots.get, name=name))).figures
    return Response(urdf_of(name, figures), media_type="application/xml")


@router.get(
    "/{name}/mjcf",
    summary="The MJCF of a robot, for MuJoCo",
    response_class=Response,
    responses={
        200: {
            "content": {"application/xml": {"schema": {"type": "string"}}},
            "description": "The MJCF",
        },
        **problem_responses(
            UnknownRobot, ShuttingDown, DeadlineExceeded, WorkerLost, StoreUnavailable
        ),
    },
)
async def robot_mjcf(name: Name, tasks: ServiceTasks) -> Response:
    """The chain of joints from `base` to `flange` with rotor inertias, friction, limits, torque
    motors and the capsules of the links, for MuJoCo. Torques in MuJoCo equal the torques of the
    answers.
    """
    return await tasks.answer(MjcfTask(name, tasks.request_id))


@router.get(
    "/{name}/joint_limits",
    summary="The joint limits of a robot, from its torques",
    response_class=Response,
    responses={
        200: {
            "content": {YAML: {"schema": {"type": "string"}}},
            "description": "`joint_limits.yaml` for MoveIt and ros2_control",
        },
        **problem_responses(
            InvalidRequest,
            UnknownRobot,
            NoJointLimits,
            ShuttingDown,
            DeadlineExceeded,
            WorkerLost,
            StoreUnavailable,
        ),
    },
)
async def robot_joint_limits(
    name: Name, query: Annotated[JointLimitsQuery, Query()], tasks: ServiceTasks
) -> Response:
    """Limits on speed and acceleration with a proof: motions within them respect the torque limits
    in every posture, with every payload up to the given mass."""
    return await tasks.answer(JointLimitsTask(name, query, tasks.request_id))


@router.get(
    "/{name}/meshes.glb",
    summary="The meshes of a robot",
    response_class=Response,
    responses={
        200: {
            "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}},
            "description": "The file",
        },
        304: {"description": "The client has it, by `If-None-Match`"},
        **problem_responses(
            UnknownRobot,
            NoMeshes,
            ShuttingDown,
            DeadlineExceeded,
            WorkerLost,
            StoreUnavailable,
        ),
    },
)
async def robot_meshes(
    request: Request, name: Name, tasks: ServiceTasks, store: ServiceStore
) -> Response:
    """Simplified meshes of the maker as a glTF file, with one node per link. A node has the name
    and the frame of its link. Available if `has_meshes` of `GET /robots/{name}` is true."""
    tag = await run_in_threadpool(digest, name) if name in robot_names() else None
    if tag is None:
        if name not in robot_names():
            await store.read(partial(robots.get, name=name))
        raise NoMeshes
    headers = {"ETag": f'"{tag}"', "Cache-Control": "no-cache"}
    if is_known(headers["ETag"], request):
        return Response(status_code=304, headers=headers)
    content = await run_in_threadpool(kept, name)
    if content is None:
        content = (await tasks.result(PictureTask(name, tasks.request_id))).document
    return Response(content, headers=headers, media_type=MEDIA_TYPE)
