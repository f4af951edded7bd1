"""GET /robots and POST /robots; GET, PUT, PATCH and DELETE /robots/{name}."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Body, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from sqlalchemy.exc import IntegrityError

from joulepath.app.api.robots.files import Name
from joulepath.app.api.robots.models import (
    ExampleMove,
    Friction,
    FrictionLaw,
    RobotDetail,
    RobotList,
    RobotSummary,
)
from joulepath.app.api.robots.request import NewRobot, OwnArm, OwnName, RobotQuery, RobotTitle
from joulepath.app.api.robots.task import OwnRobotTask
from joulepath.app.api.shared.dependencies import ServiceClient, ServiceStore
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import LOCATION_HEADER, set_location
from joulepath.app.api.shared.problem_lists import ADDING_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import RobotExists, StoreUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.examples.own_arm import TITLE_EXAMPLES
from joulepath.app.store import robots
from joulepath.app.store.tables import OwnRobot, now
from joulepath.models.form import link_bodies
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.pictures import picture_sources
from joulepath.models.registry import robot_names
from joulepath.models.robot import FrictionLaw as Law
from joulepath.models.trust import TRUST, energy_trust
from joulepath.optimizer.collision.example_move import ExampleMove as Move
from joulepath.optimizer.collision.example_move import example_move
from joulepath.optimizer.exceptions import UnknownRobot
from joulepath.optimizer.problem.robots import load_robot

router = APIRouter(prefix="/robots", tags=["robots"], route_class=LargeBodyRoute)

NewName = Annotated[OwnName, Path(description="Name of the robot.", examples=["my_arm"])]

_SECTIONS = (
    "kinematics",
    "inertials",
    "limits",
    "collision",
    "hulls",
    "drives",
    "electronics",
    "default_motion",
)


@router.get(
    "",
    summary="All robots",
    response_model=RobotList,
    responses=problem_responses(InvalidRequest, StoreUnavailable),
)
async def list_robots(query: Annotated[RobotQuery, Query()], store: ServiceStore) -> RobotList:
    """Names, titles, joints and trust in the energies of all robots, or of the robots found by
    `search`."""
    bundled = await run_in_threadpool(
        lambda: {name: load_robot(name).figures for name in robot_names()}
    )
    added = await store.read(robots.all_of)
    listed = [
        *(
            RobotSummary(**_summary(name, figures, added=False, owner=None))
            for name, figures in bundled.items()
        ),
        *(
            RobotSummary(**_summary(each.name, each.figures, added=True, owner=each.owner))
            for each in added
        ),
    ]
    text = (query.search or "").casefold()
    return RobotList(
        robots=[each for each in listed if text in f"{each.name}\n{each.title}".casefold()]
    )


@router.post(
    "",
    summary="Add a robot",
    status_code=201,
    response_model=RobotDetail,
    responses={
        201: {"headers": LOCATION_HEADER},
        **problem_responses(*ADDING_PROBLEMS, RobotExists),
    },
)
async def add_robot(
    request: Request,
    response: Response,
    body: NewRobot,
    tasks: ServiceTasks,
) -> RobotDetail:
    """Adds an arm of your own, from its URDF and further parameters. Missing parameters follow from
    documented rules, carry the trust letter E, and are listed in `warnings`."""
    robots.check_own(body.name)
    robot = await _computed(tasks, body.name, body)
    try:
        await tasks.store.write(partial(robots.add, robot=robot, most=tasks.settings.max_robots))
    except IntegrityError:  # another process has just added a robot of this name
        raise RobotExists from None
    set_location(request, response, f"/robots/{body.name}")
    return await run_in_threadpool(_of_user, robot)


@router.get(
    "/{name}",
    summary="All parameters of a robot",
    response_model=RobotDetail,
    responses=problem_responses(UnknownRobot, StoreUnavailable),
)
async def show_robot(name: Name, store: ServiceStore) -> RobotDetail:
    """Kinematics, inertials, limits, drives and electronics, each parameter with its source and
    trust letter. Also the friction laws with their coefficients."""
    if name in robot_names():
        return await run_in_threadpool(_bundled, name)
    get = partial(robots.get, name=name)
    return await store.read(lambda session: _of_user(get(session)))


@router.put(
    "/{name}",
    summary="Add or replace a robot",
    response_model=RobotDetail,
    responses={
        201: {"model": RobotDetail, "description": "Added", "headers": LOCATION_HEADER},
        **problem_responses(*ADDING_PROBLEMS, RobotExists, NotOwner),
    },
)
async def put_robot(
    request: Request,
    response: Response,
    name: NewName,
    body: OwnArm,
    tasks: ServiceTasks,
) -> RobotDetail:
    """Adds an arm of your own under this name, or replaces it. Subsequent requests use the new
    arm; stored answers remain unchanged."""
    robots.check_own(name)
    robot = await _computed(tasks, name, body)
    most, client = tasks.settings.max_robots, tasks.client
    is_new = await tasks.store.create(partial(robots.put, robot=robot, most=most, client=client))
    if is_new:
        response.status_code = 201
        set_location(request, response, f"/robots/{name}")
    return await run_in_threadpool(_of_user, robot)


@router.patch(
    "/{name}",
    summary="Name a robot",
    response_model=RobotDetail,
    responses=problem_responses(
        InvalidRequest, UnknownRobot, RobotExists, NotOwner, StoreUnavailable
    ),
)
async def rename_robot(
    name: Name,
    body: Annotated[RobotTitle, Body(openapi_examples=TITLE_EXAMPLES)],
    store: ServiceStore,
    client: ServiceClient,
) -> RobotDetail:
    """Changes the title of an added robot. Its name in requests stays."""
    rename = partial(robots.rename, name=name, title=body.title, client=client)
    return await store.write(lambda session: _of_user(rename(session)))


@router.delete(
    "/{name}",
    summary="Delete a robot",
    status_code=204,
    responses=problem_responses(UnknownRobot, RobotExists, NotOwner, StoreUnavailable),
)
async def delete_robot(name: Name, store: ServiceStore, client: ServiceClient) -> None:
    """Deletes an added robot. Its studies and stored answers are kept."""
    await store.write(partial(robots.delete, name=name, client=client), frees=True)


async def _computed(tasks: ServiceTasks, name: str, arm: OwnArm) -> OwnRobot:
    """Compute the row of a user's arm in a worker. Raises InvalidProblem."""
    result = await tasks.result(OwnRobotTask(name, arm, tasks.request_id))
    content = orjson.loads(result.document)
    return OwnRobot(name=name, created=now(), owner=tasks.client.owner, **content)


def _bundled(name: str) -> RobotDetail:
    robot = load_robot(name)
    return _detail(
        name, robot.figures, added=False, owner=None, warnings=[], example=example_move(robot)
    )


def _of_user(row: OwnRobot) -> RobotDetail:
    try:
        example = example_move(own_robot(row.name, row.figures))
    except (ValueError, KeyError):  # an earlier version stored figures that make no robot now
        example = None
    owner, warnings = row.owner, row.warnings
    return _detail(
        row.name, row.figures, added=True, owner=owner, warnings=warnings, example=example
    )


def _detail(
    name: str,
    figures: dict[str, Any],
    added: bool,
    owner: str | None,
    warnings: list[str],
    example: Move | None,
) -> RobotDetail:
    content: dict[str, Any] = {section: figures.get(section) for section in _SECTIONS}
    content |= _summary(name, figures, added, owner)
    content |= {"trust": TRUST, "friction": _friction(figures), "warnings": warnings}
    content["form"] = [[asdict(body) for body in link] for link in link_bodies(figures)]
    content["has_meshes"] = picture_sources(name) is not None
    content["example_move"] = example and ExampleMove(
        start=example.start.tolist(), goal=example.goal.tolist()
    )
    return RobotDetail(**content)


def _friction(figures: dict[str, Any]) -> Friction:
    laws = figures["friction_laws"]
    default = next(iter(laws))
    return Friction(
        table=figures["friction_table"],
        laws=[
            FrictionLaw(
                name=name,
                default=name == default,
                formula=Law.LOAD_FORMULA if "load" in coefficients else Law.FORMULA,
                coefficients=coefficients,
            )
            for name, coefficients in laws.items()
        ],
    )


def _summary(name: str, figures: dict[str, Any], added: bool, owner: str | None) -> dict[str, Any]:
    return {
        "name": name,
        "title": figures["title"],
        "joints": figures["kinematics"]["joint_names"]["value"],
        "rated_payload": figures["limits"]["rated_payload"]["value"],
        "added": added,
        "owner": owner,
        "energy_trust": energy_trust(figures),
    }
