"""From the arm in a request to the arm of the library."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import orjson

from joulepath.app.convert.items import item
from joulepath.app.convert.pose import to_base
from joulepath.app.convert.robots import own_robot_of, with_figures
from joulepath.app.convert.scene import to_attachment, to_scene
from joulepath.app.convert.tool import to_tcp, to_tool, with_tool
from joulepath.app.schemas import arm as asked
from joulepath.app.schemas.arm import ArmRequest
from joulepath.models.registry import robot_names
from joulepath.models.robot import Array, Limits, Robot
from joulepath.optimizer.exceptions import InvalidProblem, UnknownRobot
from joulepath.optimizer.problem.arm import (
    INVERTER_COEFFICIENTS,
    LIMIT_NAMES,
    Arm,
    Inverter,
    Payload,
)
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.even_body import even_payload
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.problem.tool_cone import ToolCone


def robot_named(name: str) -> Robot:
    """The bundled robot of this name, or the own robot of this request.

    Raises UnknownRobot or InvalidProblem.
    """
    if name in robot_names():
        return load_robot(name)
    figures = item(("robot", name))
    if figures is None:
        raise UnknownRobot(name, list(robot_names()))
    return own_robot_of(name, figures)


def to_arm(request: asked.ArmRequest) -> Arm:
    """The arm of the library. Raises UnknownRobot, UnknownTool, UnknownFigures or
    InvalidProblem."""
    robot = robot_named(request.robot)
    if request.figures is not None:
        robot = with_figures(robot, request.figures)
    return Arm(
        robot=robot,
        T_flange_tcp=to_tcp(request.tcp, request.tool),
        payload=with_tool(request.tool, to_payload(request.payload)),
        gravity=robot.gravity if request.gravity is None else np.array(request.gravity),
        limits=to_limits(request.limits, robot),
        friction=request.friction,
        inverter=Inverter(
            **{name: getattr(request.drives.inverter, name) for name in INVERTER_COEFFICIENTS}
        ),
        bus=_to_bus(request.bus),
        link_mass_scale=np.array(request.link_mass_scale),
        tool=to_tool(request.tool),
        scene=to_scene(request.scene, robot),
        collisions=request.collisions,
        tool_cone=_to_tool_cone(request.tool_cone, robot),
        tcp_speed=request.limits.tcp_speed,
        elbow_speed=request.limits.elbow_speed,
    )


def _to_bus(bus: asked.Bus) -> Bus:
    if isinstance(bus, asked.RecuperatingBus):
        return Bus("recuperating", efficiency=bus.efficiency)
    if isinstance(bus, asked.StorageBus):
        power = math.inf if bus.power is None else bus.power
        return Bus("storage", bus.efficiency, bus.capacity, power, bus.initial)
    return Bus(bus.mode)


def _to_tool_cone(cone: asked.ToolCone | None, robot: Robot) -> ToolCone | None:
    if cone is None:
        return None
    direction = to_base(cone.frame, robot)[:3, :3] @ cone.direction
    return ToolCone(np.array(cone.axis), direction, cone.half_angle)


def to_payload(payload: asked.Payload | None) -> Payload:
    """The payload of the library; without mass if there is none. Raises InvalidProblem."""
    if payload is None:
        return Payload()
    shape = None if payload.shape is None else to_attachment(payload.shape, payload.touches)
    if payload.com is None and shape is not None:
        body = even_payload(payload.mass, shape)
    else:
        body = Payload(payload.mass, np.array(payload.com or [0.0] * 3), shape=shape)
    if payload.inertia is None:
        return body
    ixx, ixy, ixz, iyy, iyz, izz = payload.inertia
    return replace(body, inertia=np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]))


def inertia_row(payload: Payload) -> list[float]:
    """The inertia of a payload as in requests."""
    inertia: list[float] = payload.inertia[np.triu_indices(3)].tolist()
    return inertia


def to_limits(limits: asked.MoveLimits, robot: Robot) -> Limits:
    """The robot's limits, updated by the request. Raises InvalidProblem."""
    tighter = {
        name: _per_joint(f"limits.{public}", getattr(limits, public), robot.nq)
        for public, name in LIMIT_NAMES.items()
    }
    if isinstance(limits, asked.Limits) and limits.position is not None:
        tighter["q_min"] = _per_joint("limits.position.lower", limits.position.lower, robot.nq)
        tighter["q_max"] = _per_joint("limits.position.upper", limits.position.upper, robot.nq)
    return robot.limits.tightened(**tighter)


def _per_joint(field: str, value: float | list[float] | None, nq: int) -> Array | None:
    if value is None:
        return None
    if isinstance(value, list) and len(value) != nq:
        raise InvalidProblem(field, f"{field} must be one number or a list of {nq}, one per joint.")
    return np.full(nq, value, dtype=float)


LARGEST = 1 << 16
"""Largest repeated arm [byte of JSON]; a front repeats it a hundred times."""
_NAMES = set(ArmRequest.model_fields) - {"robot"}


def arm_fields(request: ArmRequest, **instead: Any) -> dict[str, Any] | None:
    """The arm fields set by the request, without the robot; None if they are large.

    `instead` replaces some fields.
    """
    content = request.model_dump(mode="json", exclude_unset=True, include=_NAMES) | instead
    return (
        content
        if len(orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)) <= LARGEST
        else None
    )
