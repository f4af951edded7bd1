"""Responses of `GET /robots` and `GET /robots/{name}`."""

from __future__ import annotations

from typing import Literal

from joulepath.app.schemas.common import Response, described, part


class Parameter(Response):
    """One parameter of a robot. A list has one entry per joint or link, from base to flange."""

    value: float | str | list[float] | list[list[float]] | list[list[list[float]]] | list[str] = (
        described(
            "Value of the parameter; a word or names, where it is no number.",
            None,
            [150.0, 150.0, 150.0, 28.0, 28.0, 28.0],
        )
    )
    unit: str = described("Unit; `1` if it has none.", None, "N·m")
    source: str = described(
        "Source of the value.", None, "github.com/UniversalRobots/Universal_Robots_ROS2_Description"
    )
    trust: Literal["A", "B", "C", "T", "E"] = described(
        "Quality of the source: see `trust` of the robot.", None, "A"
    )
    note: str = described("Remarks.", None, "Of the motor at the joint.")


Parameters = dict[str, Parameter]


class FrictionLaw(Response):
    """A friction model: friction torque as a function of joint velocity."""

    name: str = described("Name, for the field `friction` of a request.", None, "curved")
    default: bool = described("Whether requests without `friction` use it.", None, True)
    formula: str = described(
        "Friction torque at joint velocity v.",
        None,
        "coulomb v / sqrt(v² + knee²) + curved asinh(v / speed) + viscous v",
    )
    coefficients: Parameters = part("Coefficients of the formula.")


class Friction(Response):
    """Joint friction: measurements and fitted models."""

    table: Parameters = part("Measured friction torques and their joint velocities.")
    laws: list[FrictionLaw] = part("Friction models, the default one first.")


class RobotSummary(Response):
    """A robot."""

    name: str = described("Name in requests.", None, "ur5e")
    title: str = described("Manufacturer and model.", None, "Universal Robots UR5e")
    joints: list[str] = described(
        "Names of the joints, from base to flange.",
        None,
        ["shoulder_pan_joint", "shoulder_lift_joint"],
    )
    rated_payload: float = described("Greatest mass of a payload.", "kg", 5.0)
    added: bool = described(
        "Whether a user added it; the others come with the service.", None, False
    )
    owner: str | None = described(
        "Name of the API key that added it; null without one.", None, "press_shop"
    )
    energy_trust: str = described(
        "Basis of the energies of this robot, from the trust letters of its parameters.",
        None,
        "Energies are based on the manufacturer's figures (link masses) and figures fitted to "
        "measured data (friction).",
    )


class RobotList(Response):
    """All robots."""

    robots: list[RobotSummary] = part("The robots.")


class FormBody(Response):
    """A round body of a link, in the frame of the link."""

    kind: Literal["housing", "cap", "ring", "tube", "foot"] = described("What it is.", None, "tube")
    start: list[float] = described("One end of its axis.", "m", [0.0, 0.0, 0.138])
    end: list[float] = described("The other end.", "m", [-0.425, 0.0, 0.138])
    radius: float = described("Its radius.", "m", 0.05)


class ExampleMove(Response):
    """A move about the first axis for a task without targets. At its ends, no links collide, and
    the flange preferably points down."""

    start: list[float] = described(
        "Joint positions at its start.", "rad", [0.0, -1.5708, -1.5708, -1.5708, 1.5708, 0.0]
    )
    goal: list[float] = described(
        "Joint positions at its goal.", "rad", [1.5708, -1.5708, -1.5708, -1.5708, 1.5708, 0.0]
    )


class RobotDetail(RobotSummary):
    """The parameters of a robot, with their sources and trust letters."""

    trust: dict[str, str] = described(
        "Meaning of the trust letters.", None, {"A": "published by the manufacturer"}
    )
    kinematics: Parameters = part("Geometry.")
    inertials: Parameters = part("Masses, centres of mass and inertias of the links.")
    limits: Parameters = part("Limits and rated payload.")
    collision: Parameters = part(
        "Capsules that hold each link, the mesh sets that they hold (`meshes`), the link that "
        "carries the elbow, and pairs of links that are never in collision. A capsule is [x1, y1, "
        "z1, x2, y2, z2, radius]: both ends of its axis in the link frame."
    )
    hulls: Parameters | None = part(
        "Convex hulls that hold each link more closely, and are compared with obstacles: for each "
        "hull of a link, points [x, y, z] in the link frame, whose hull is grown by `radius`. With "
        "`between_links`, links are compared with each other by their hulls, too. Null for a robot "
        "without hulls."
    )
    drives: Parameters = part("Motors, gears and inverters.")
    electronics: Parameters = part(
        "Power that the electronics draw, and what the supply takes back."
    )
    friction: Friction = part("Joint friction.")
    default_motion: Parameters | None = part(
        "Default speed and acceleration of the robot's own controller; null if they are unknown."
    )
    form: list[list[FormBody]] = part(
        "What each link looks like by these parameters, base first: tubes between the joints "
        "and round housings with caps at them. It is not used for collision checks."
    )
    example_move: ExampleMove | None = part(
        "A first move for a task without targets; null if the links overlap in every posture that "
        "was tried."
    )
    has_meshes: bool = described(
        "Whether `GET /robots/{name}/meshes.glb` has the maker's meshes of the links.", None, True
    )
    warnings: list[str] = described(
        "Of a robot that a user added: implausible values, and parameters that are engineering "
        "defaults.",
        None,
        ["Engineering defaults, see their notes: limits.jerk."],
    )
