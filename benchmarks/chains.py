"""Robots with a shortened or extended chain, to measure the growth of times with the degrees of freedom."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Drives, FrictionLaw, Limits, Robot

T = TypeVar("T", Limits, Drives, FrictionLaw)


def chain(robot: Robot, count: int) -> Robot:
    """The robot with its first `count` joints. If it has fewer, its last joint and link are repeated with another axis.

    Links of omitted joints stay fixed, in their zero position, at the last remaining joint.
    """
    model = _cut(robot, count) if count <= robot.nq else _extended(robot, count)
    laws = {name: _resized(law, count) for name, law in robot.friction_laws.items()}
    return replace(
        robot,
        name=f"{robot.name}-{count}-joints",
        model=model,
        limits=_resized(robot.limits, count),
        drives=_resized(robot.drives, count),
        friction_laws=laws,
    )


def _cut(robot: Robot, count: int) -> pin.Model:
    locked = list(range(count + 1, robot.nq + 1))
    return pin.buildReducedModel(robot.model, locked, np.zeros(robot.nq)) if locked else robot.model


def _extended(robot: Robot, count: int) -> pin.Model:
    base, flange = robot.model, robot.model.frames[robot.model.getFrameId("flange")].placement
    model = pin.Model()
    for k in range(1, count + 1):
        own = min(k, base.njoints - 1)
        # each copy rotates about an axis perpendicular to the last joint's, one flange length further out
        across = flange * pin.SE3(pin.rpy.rpyToMatrix(np.pi / 2, 0.0, 0.0), np.zeros(3))
        placement = base.jointPlacements[own] if k == own else across
        joint = model.addJoint(k - 1, pin.JointModelRZ(), placement, f"joint_{k}")
        model.appendBodyToJoint(joint, base.inertias[own], pin.SE3.Identity())
    model.addFrame(pin.Frame("flange", count, 0, flange, pin.FrameType.BODY))
    model.gravity.linear = base.gravity.linear
    model.armature = _sized(robot.drives.rotor_inertia, count)
    return model


def _resized(parameters: T, count: int) -> T:
    """The same parameters for another number of joints."""
    values = {field.name: getattr(parameters, field.name) for field in fields(parameters)}
    arrays: dict[str, Any] = {name: _sized(v, count) for name, v in values.items() if isinstance(v, np.ndarray)}
    return replace(parameters, **arrays)


def _sized(values: Array, count: int) -> Array:
    return np.append(values[:count], np.repeat(values[-1:], max(count - len(values), 0)))
