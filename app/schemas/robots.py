"""What `GET /robots` and `GET /robots/{name}` answer."""

from __future__ import annotations

from typing import Literal

from app.schemas.common import Response, described, part


class Figure(Response):
    """One figure of a robot; lists run over the joints from base to flange."""

    value: float | list[float] | list[list[float]] = described(
        "The figure.", None, [150.0, 150.0, 150.0, 28.0, 28.0, 28.0]
    )
    unit: str = described("Its unit; `1` where it has none.", None, "N·m")
    source: str = described(
        "Where it comes from.", None, "github.com/UniversalRobots/Universal_Robots_ROS2_Description"
    )
    trust: Literal["A", "B", "C", "T", "E"] = described("How far to trust it: see `trust`.", None, "A")
    note: str = described("What else to know.", None, "Of the motor at the joint.")


Figures = dict[str, Figure]


class FrictionLaw(Response):
    """One friction law: torque over joint speed."""

    name: str = described("Its name, for a request's `friction`.", None, "curved")
    default: bool = described("Whether it holds when a request names none.", None, True)
    formula: str = described(
        "Torque at joint speed v.", None, "coulomb v / sqrt(v² + knee²) + curved asinh(v / speed) + viscous v"
    )
    coefficients: Figures = part("The formula's coefficients.")


class Friction(Response):
    """Joint friction: what was measured, and the laws fitted to it."""

    table: Figures = part("Measurements.")
    laws: list[FrictionLaw] = part("The laws, the default one first.")


class RobotSummary(Response):
    """A robot in a list."""

    name: str = described("Its name in requests.", None, "ur5e")
    title: str = described("Its maker and model.", None, "Universal Robots UR5e")
    joints: list[str] = described("Joints from base to flange.", None, ["shoulder_pan_joint", "shoulder_lift_joint"])


class RobotList(Response):
    """Every robot there is."""

    robots: list[RobotSummary] = part("The robots.")


class RobotDetail(RobotSummary):
    """All that is known of a robot, each figure with its source and trust."""

    trust: dict[str, str] = described("What the trust letters mean.", None, {"A": "maker's own file or data packet"})
    kinematics: Figures = part("Geometry.")
    inertials: Figures = part("Masses and inertias of the links.")
    limits: Figures = part("Limits and rated payload.")
    collision: Figures = part(
        "Capsules that each link lies within (rows of x1, y1, z1, x2, y2, z2 of the axis' ends in the link frame, and "
        "radius), and the pairs of links that never meet."
    )
    drives: Figures = part("Motors, gears and inverters.")
    electronics: Figures = part("What the arm draws besides its motors.")
    friction: Friction = part("Joint friction.")
    default_motion: Figures = part("How the robot's own controller moves when it is told nothing.")
