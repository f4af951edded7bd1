"""What `GET /robots` and `GET /robots/{name}` answer."""

from __future__ import annotations

from typing import Literal

from app.schemas.common import Response, described

_FIGURE = {
    "value": [150.0, 150.0, 150.0, 28.0, 28.0, 28.0],
    "unit": "N·m",
    "source": "Universal_Robots_ROS2_Description",
    "trust": "A",
    "note": "Of the motor at the joint.",
}


class Figure(Response):
    """One figure of a robot; lists run over the joints from base to flange."""

    value: float | list[float] | list[list[float]] = described("The figure.", None, _FIGURE["value"])
    unit: str = described("Its unit; `1` where it has none.", None, "N·m")
    source: str = described("Where it comes from.", None, _FIGURE["source"])
    trust: Literal["A", "B", "C", "T", "E"] = described("How far to trust it: see `trust`.", None, "A")
    note: str = described("What else to know.", None, _FIGURE["note"])


Figures = dict[str, Figure]


class FrictionLaw(Response):
    """One friction law: torque over joint speed."""

    name: str = described("Its name, for a request's `friction`.", None, "curved")
    default: bool = described("Whether it holds when a request names none.", None, True)
    formula: str = described(
        "Torque at joint speed v.", None, "coulomb v / sqrt(v² + knee²) + curved asinh(v / speed) + viscous v"
    )
    coefficients: Figures = described("The formula's coefficients.", None, {"coulomb": _FIGURE})


class Friction(Response):
    """Joint friction: what was measured, and the laws fitted to it."""

    table: Figures = described("Measurements.", None, {"torque": _FIGURE})
    laws: list[FrictionLaw] = described("The laws, the default one first.", None, [{"name": "curved"}])


class RobotSummary(Response):
    """A robot in a list."""

    name: str = described("Its name in requests.", None, "ur5e")
    title: str = described("Its maker and model.", None, "Universal Robots UR5e")
    joints: list[str] = described("Joints from base to flange.", None, ["shoulder_pan_joint", "shoulder_lift_joint"])


class RobotList(Response):
    """Every robot there is."""

    robots: list[RobotSummary] = described(
        "The robots.", None, [{"name": "ur5e", "title": "Universal Robots UR5e", "joints": ["shoulder_pan_joint"]}]
    )


class RobotDetail(RobotSummary):
    """All that is known of a robot, each figure with its source and trust."""

    trust: dict[str, str] = described("What the trust letters mean.", None, {"A": "maker's own file or data packet"})
    kinematics: Figures = described("Geometry.", None, {"dh_a": _FIGURE})
    inertials: Figures = described("Masses and inertias of the links.", None, {"mass": _FIGURE})
    limits: Figures = described("Limits and rated payload.", None, {"torque": _FIGURE})
    drives: Figures = described("Motors, gears and inverters.", None, {"torque_constant": _FIGURE})
    electronics: Figures = described("What the arm draws besides its motors.", None, {"idle_power": _FIGURE})
    friction: Friction = described("Joint friction.", None, {"laws": [{"name": "curved", "default": True}]})
    default_motion: Figures = described(
        "How the robot's own controller moves when it is told nothing.", None, {"velocity": _FIGURE}
    )
