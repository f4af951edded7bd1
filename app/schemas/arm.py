"""What every request about a motion says of the arm: what it carries, its limits, drives, bus and surroundings."""

from __future__ import annotations

from math import pi
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from app.schemas.common import Request, Vector3, described
from app.schemas.orientation import Axis
from app.schemas.scene import CarriedShape, CellRequest

# with less, a motion would last longer than any answer may
Rate = Annotated[float, Field(ge=1e-2, le=1e6)]
Angle = Annotated[float, Field(ge=-1e3, le=1e3)]


def by_shape(value: Any) -> str | None:
    """The tag of a number or a list."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return "one"
    return "each" if isinstance(value, list) else None


_SHAPE = Discriminator(
    by_shape, custom_error_type="one_or_each", custom_error_message="Give one number or a list with one per joint"
)
RatePerJoint = Annotated[
    Annotated[Rate, Tag("one")] | Annotated[Annotated[list[Rate], Field(min_length=1, max_length=16)], Tag("each")],
    _SHAPE,
]
AnglePerJoint = Annotated[
    Annotated[Angle, Tag("one")] | Annotated[Annotated[list[Angle], Field(min_length=1, max_length=16)], Tag("each")],
    _SHAPE,
]


class Payload(Request):
    """A body fixed to the flange."""

    mass: float = described("Mass.", "kg", 2.0, ge=0, le=1e3)
    com: Vector3 = described("Centre of mass in the flange frame.", "m", [0.0, 0.0, 0.05])
    inertia: list[float] | None = described(
        "Inertia about the centre of mass in flange axes: ixx, ixy, ixz, iyy, iyz, izz. Null: a point mass.",
        "kg·m²",
        [0.004, 0.0, 0.0, 0.004, 0.0, 0.003],
        default=None,
        min_length=6,
        max_length=6,
    )
    shape: CarriedShape | None = described(
        "The space that it takes up, with its pose in the flange frame, for collisions. Null: none.",
        None,
        {"shape": "box", "size": [0.1, 0.1, 0.2], "pose": {"position": [0, 0, 0.2], "rotvec": [0, 0, 0]}},
        default=None,
    )


# slower, a motion would last longer than any answer may
Speed = Annotated[float, Field(ge=1e-3, le=1e3)]


class PositionLimits(Request):
    """A narrower joint range. One number holds for every joint."""

    lower: AnglePerJoint | None = described("Least joint positions.", "rad", -3.0, default=None)
    upper: AnglePerJoint | None = described("Greatest joint positions.", "rad", 3.0, default=None)


class Limits(Request):
    """Limits tighter than the robot's. One number holds for every joint, a list gives one per joint."""

    velocity: RatePerJoint | None = described("Greatest joint speed.", "rad/s", 2.0, default=None)
    acceleration: RatePerJoint | None = described("Greatest joint acceleration.", "rad/s²", 5.0, default=None)
    jerk: RatePerJoint | None = described("Greatest joint jerk.", "rad/s³", 100.0, default=None)
    torque: RatePerJoint | None = described(
        "Greatest motor torque at the joint: rigid body, rotor and friction together.",
        "N·m",
        [120.0, 120.0, 120.0, 20.0, 20.0, 20.0],
        default=None,
    )
    position: PositionLimits | None = described(
        "Narrower joint range.", None, {"lower": -3.0, "upper": 3.0}, default=None
    )
    tcp_speed: Speed | None = described("Greatest speed of the TCP.", "m/s", 0.25, default=None)
    elbow_speed: Speed | None = described(
        "Greatest speed of the elbow: of both ends of its joint's housing.", "m/s", 0.25, default=None
    )


class ToolCone(Request):
    """An axis of the tool stays near a direction all along the motion."""

    axis: Axis = described("Axis of the tool, in the TCP frame; any length.", "1", [0.0, 0.0, 1.0])
    direction: Axis = described("Where it should point, in the base frame; any length.", "1", [0.0, 0.0, -1.0])
    half_angle: float = described("How far it may be from there.", "rad", 0.2, ge=1e-3, le=pi)


Scale = Annotated[float, Field(ge=0.1, le=10)]
_ScaleList = Annotated[list[Scale], Field(min_length=1, max_length=16)]
ScalePerJoint = Annotated[Annotated[Scale, Tag("one")] | Annotated[_ScaleList, Tag("each")], _SHAPE]
Loss = Annotated[float, Field(ge=0, le=1e3)]
_LossList = Annotated[list[Loss], Field(min_length=1, max_length=16)]
LossPerJoint = Annotated[Annotated[Loss, Tag("one")] | Annotated[_LossList, Tag("each")], _SHAPE]
Share = Annotated[float, Field(ge=0, le=1)]


class Inverter(Request):
    """The inverters' loss constant + linear·|i| + quadratic·i². One number holds for every joint; null: the robot's."""

    constant: LossPerJoint | None = described("Loss at no current.", "W", 1.5, default=None)
    linear: LossPerJoint | None = described("Loss per current.", "W/A", 0.6, default=None)
    quadratic: LossPerJoint | None = described("Loss per current squared.", "W/A²", 0.02, default=None)


class Drives(Request):
    """Motors, gears and inverters: what may differ from the robot's figures."""

    inverter: Inverter = described("Loss of the inverters.", None, {"constant": 1.5, "linear": 0.6}, default=Inverter())


class SharedBus(Request):
    """Joints exchange power; what is left over is burnt, but for the share that the robot's own supply takes back."""

    mode: Literal["shared"] = described("Surplus feeds the other joints; the rest is burnt.", None, "shared")


class IsolatedBus(Request):
    """Every joint burns its own surplus."""

    mode: Literal["isolated"] = described("No joint's surplus feeds another.", None, "isolated")


class RecuperatingBus(Request):
    """Joints exchange power; what is left over is fed back."""

    mode: Literal["recuperating"] = described(
        "Surplus feeds the other joints; the rest goes back.", None, "recuperating"
    )
    efficiency: Share = described("Share of the net surplus that is worth as much as what is drawn.", "1", 0.8)


class StorageBus(Request):
    """Joints exchange power; what is left over charges a capacitor or flywheel on the bus, which feeds later demand."""

    mode: Literal["storage"] = described("Surplus feeds the other joints; the rest is stored.", None, "storage")
    capacity: float = described("Charge that the full store can give back.", "J", 30.0, ge=0, le=1e9)
    power: Annotated[float, Field(gt=0, le=1e9)] | None = described(
        "Most that goes into or comes out of the store. Null: no limit.", "W", 500.0, default=None
    )
    efficiency: Share = described("Of a round trip; the loss is taken on the way in.", "1", 0.9, default=1.0)
    initial: float = described(
        "Charge at the start, at most `capacity`; what is used up of it counts as drawn.",
        "J",
        0.0,
        default=0.0,
        ge=0,
        le=1e9,
    )


def _by_mode(value: Any) -> str | None:
    mode = value.get("mode") if isinstance(value, dict) else getattr(value, "mode", None)
    return mode if mode in ("shared", "isolated", "recuperating", "storage") else None


Bus = Annotated[
    Annotated[SharedBus, Tag("shared")]
    | Annotated[IsolatedBus, Tag("isolated")]
    | Annotated[RecuperatingBus, Tag("recuperating")]
    | Annotated[StorageBus, Tag("storage")],
    Discriminator(
        _by_mode,
        custom_error_type="bus_mode",
        custom_error_message="Give an object whose `mode` is shared, isolated, recuperating or storage",
    ),
]


class ArmRequest(CellRequest):
    """What every request about a motion says of the arm."""

    payload: Payload | None = described(
        "What the flange carries. Null: nothing.", None, {"mass": 2.0, "com": [0.0, 0.0, 0.05]}, default=None
    )
    gravity: Annotated[list[Annotated[float, Field(ge=-100, le=100)]], Field(min_length=3, max_length=3)] = described(
        "Gravity in the base frame: turn it for a wall or ceiling mount.",
        "m/s²",
        [0.0, 0.0, -9.81],
        default=[0.0, 0.0, -9.81],
    )
    limits: Limits = described(
        "Limits to keep besides the robot's own; they may only tighten these.",
        None,
        {"velocity": 2.0},
        default=Limits(),
    )
    friction: Annotated[str, Field(min_length=1, max_length=64)] | None = described(
        "Name of one of the robot's friction laws, from `GET /robots/{name}`. Null: its default.",
        None,
        "curved",
        default=None,
    )
    drives: Drives = described(
        "Figures of the drives in place of the robot's own.", None, {"inverter": {"constant": 1.5}}, default=Drives()
    )
    bus: Bus = described(
        "Where the joints' surplus power goes.",
        None,
        {"mode": "storage", "capacity": 30.0, "power": 500.0, "efficiency": 0.9},
        default=SharedBus(mode="shared"),
    )
    link_mass_scale: ScalePerJoint = described(
        "Factor on mass and inertia of the moving links, payload and rotors apart: one number, or one per joint for "
        "the link that it moves.",
        "1",
        0.8,
        default=1.0,
    )
    collisions: bool = described(
        "Whether the arm is kept from hitting itself and the scene. False: nothing is compared, whatever `tool`, "
        "`scene` and `payload.shape` say; for motions known to be free where the links' capsules are too coarse.",
        None,
        True,
        default=True,
    )
    tool_cone: ToolCone | None = described(
        "Keep an axis of the tool near a direction all along: a glass upright. Null: it may point anywhere.",
        None,
        {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.2},
        default=None,
    )
