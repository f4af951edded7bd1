"""GET /robots and GET /robots/{name}."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any

from fastapi import APIRouter, Path

from app.convert.arm import robot_named
from app.http.openapi import problem_responses
from app.schemas import errors as problems
from app.schemas.robots import Friction, FrictionLaw, RobotDetail, RobotList, RobotSummary
from models.registry import load_robot, robot_names
from models.robot import Robot
from models.trust import TRUST, energy_trust

router = APIRouter(prefix="/robots", tags=["robots"])

_SECTIONS = ("kinematics", "inertials", "limits", "collision", "drives", "electronics", "default_motion")


@router.get("", summary="All robots", response_model=RobotList, responses=problem_responses())
def list_robots() -> RobotList:
    """Names, titles and joints of all robots, and what their energies rest on."""
    return RobotList(robots=[RobotSummary(**_summary(load_robot(name))) for name in robot_names()])


@router.get(
    "/{name}",
    summary="All parameters of a robot",
    response_model=RobotDetail,
    responses=problem_responses(problems.UnknownRobot),
)
def show_robot(
    name: Annotated[str, Path(description="Name of the robot, from `GET /robots`.", examples=["ur5e"])],
) -> RobotDetail:
    """Kinematics, inertials, limits, drives and electronics, each parameter with its source and trust letter. Also the
    friction laws with their coefficients."""
    return _detail(robot_named(name).name)


@cache
def _detail(name: str) -> RobotDetail:
    robot = load_robot(name)
    # a robot whose maker publishes no default motion has none
    sections = {section: robot.figures.get(section, {}) for section in _SECTIONS}
    return RobotDetail(**_summary(robot), trust=TRUST, friction=_friction(robot), **sections)


def _friction(robot: Robot) -> Friction:
    figures = robot.figures["friction_laws"]
    return Friction(
        table=robot.figures["friction_table"],
        laws=[
            FrictionLaw(name=law.name, default=law is robot.friction, formula=law.FORMULA, coefficients=figures[name])
            for name, law in robot.friction_laws.items()
        ],
    )


def _summary(robot: Robot) -> dict[str, Any]:
    return {
        "name": robot.name,
        "title": robot.title,
        "joints": list(robot.joint_names),
        "energy_trust": energy_trust(robot.figures),
    }
