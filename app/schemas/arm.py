"""The arm in a request about a motion: payload, limits, drives, power bus, and surroundings."""

from __future__ import annotations

from math import pi
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, ValidationError, model_validator
from pydantic_core import InitErrorDetails

from joulepath.app.schemas.common import FiguresId, Frame, Request, Vector3, described, frame_of
from joulepath.app.schemas.examples.figures import FIGURES_ID
from joulepath.app.schemas.examples.values import BOX
from joulepath.app.schemas.orientation import Cone
from joulepath.app.schemas.scene import CarriedShape, CellRequest, LinkNames, touched_links

# with a smaller limit, a motion would exceed the largest duration
Rate = Annotated[float, Field(ge=1e-2, le=1e6)]
Angle = Annotated[float, Field(ge=-1e3, le=1e3)]


def one_or_each(value: Any) -> str | None:
    """Discriminator of a union of a number (tag `one`) and a list (tag `each`)."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return "one"
    return "each" if isinstance(value, list) else None


_ONE_OR_EACH = Discriminator(
    one_or_each,
    custom_error_type="one_or_each",
    custom_error_message="Give one number or a list with one per joint",
)
RatePerJoint = Annotated[
    Annotated[Rate, Tag("one")]
    | Annotated[Annotated[list[Rate], Field(min_length=1, max_length=16)], Tag("each")],
    _ONE_OR_EACH,
]
AnglePerJoint = Annotated[
    Annotated[Angle, Tag("one")]
    | Annotated[Annotated[list[Angle], Field(min_length=1, max_length=16)], Tag("each")],
    _ONE_OR_EACH,
]


class Payload(Request):
    """A body fixed to the flange."""

    mass: float = described("Mass.", "kg", 2.0, ge=0, le=1e3)
    com: Vector3 | None = described(
        "Centre of mass in the flange frame. Null: the centre of `shape`, filled with uniform "
        "density. Required unless there is a `shape` or `mass` is 0.",
        "m",
        [0.0, 0.0, 0.05],
        default=None,
    )
    inertia: list[float] | None = described(
        "Inertia about the centre of mass, in the axes of the flange frame: [ixx, ixy, ixz, iyy, "
        "iyz, izz]. Null: the inertia of `shape`, filled with uniform density, if `com` is null "
        "too; otherwise a point mass.",
        "kg·m²",
        [0.004, 0.0, 0.0, 0.004, 0.0, 0.003],
        default=None,
        min_length=6,
        max_length=6,
    )
    shape: CarriedShape | None = described(
        "Shape for collision checking, with its pose in the flange frame. Null: no shape.",
        None,
        BOX,
        default=None,
    )
    touches: LinkNames | None = touched_links("payload")

    @model_validator(mode="after")
    def _has_a_centre(self) -> Self:
        if self.mass > 0 and self.com is None and self.shape is None:
            missing = InitErrorDetails(
                type="missing", loc=("com",), input=self.model_dump(exclude_unset=True)
            )
            raise ValidationError.from_exception_data("Payload", [missing])
        return self


# with a smaller limit, a motion would exceed the largest duration
Speed = Annotated[float, Field(ge=1e-3, le=1e3)]


class PositionLimits(Request):
    """A narrower joint range. One number applies to every joint, a list has one per joint."""

    lower: AnglePerJoint | None = described("Smallest joint position.", "rad", -3.0, default=None)
    upper: AnglePerJoint | None = described("Largest joint position.", "rad", 3.0, default=None)


class MoveLimits(Request):
    """Limits within those of the robot. One number applies to every joint, a list has one per
    joint. Null: the robot's."""

    velocity: RatePerJoint | None = described(
        "Largest absolute joint velocity.", "rad/s", 2.0, default=None
    )
    acceleration: RatePerJoint | None = described(
        "Largest absolute joint acceleration.", "rad/s²", 5.0, default=None
    )
    jerk: RatePerJoint | None = described(
        "Largest absolute joint jerk.", "rad/s³", 100.0, default=None
    )
    torque: RatePerJoint | None = described(
        "Largest absolute torque at the joint: of the motor, with rotor and friction, or of the "
        "link, without, as the robot's `limits.torque_side` says.",
        "N·m",
        [120.0, 120.0, 120.0, 20.0, 20.0, 20.0],
        default=None,
    )
    tcp_speed: Speed | None = described("Largest speed of the TCP.", "m/s", 0.25, default=None)
    elbow_speed: Speed | None = described(
        "Largest speed of the elbow: of both ends of the axis of its capsule.",
        "m/s",
        0.25,
        default=None,
    )


class Limits(MoveLimits):
    """Limits within those of the robot. One number applies to every joint, a list has one per
    joint. Null: the robot's."""

    position: PositionLimits | None = described(
        "Narrower joint range.", None, {"lower": -3.0, "upper": 3.0}, default=None
    )


class ToolCone(Cone):
    """An axis of the tool stays within an angle of a direction during the whole motion."""

    half_angle: float = described(
        "Largest allowed angle between `axis` and `direction`.", "rad", 0.2, ge=1e-3, le=pi
    )
    frame: Frame = frame_of("`direction`")


Scale = Annotated[float, Field(ge=0.1, le=10)]
_ScaleList = Annotated[list[Scale], Field(min_length=1, max_length=16)]
ScalePerJoint = Annotated[
    Annotated[Scale, Tag("one")] | Annotated[_ScaleList, Tag("each")], _ONE_OR_EACH
]
Loss = Annotated[float, Field(ge=0, le=1e3)]
_LossList = Annotated[list[Loss], Field(min_length=1, max_length=16)]
LossPerJoint = Annotated[
    Annotated[Loss, Tag("one")] | Annotated[_LossList, Tag("each")], _ONE_OR_EACH
]
Share = Annotated[float, Field(ge=0, le=1)]


class Inverter(Request):
    """Loss of an inverter at the motor current i: constant + linear·|i| + quadratic·i². One number
    applies to every joint, a list has one per joint. Null: the robot's own parameter."""

    constant: LossPerJoint | None = described("Loss at zero current.", "W", 1.5, default=None)
    linear: LossPerJoint | None = described("Loss per ampere.", "W/A", 0.6, default=None)
    quadratic: LossPerJoint | None = described(
        "Loss per ampere squared.", "W/A²", 0.02, default=None
    )


class Drives(Request):
    """Drives of the joints: motors, gears and inverters."""

    inverter: Inverter = described(
        "Loss of the inverters.", None, {"constant": 1.5, "linear": 0.6}, default=Inverter()
    )


class SharedBus(Request):
    """Joints exchange power. The supply takes back the fraction `regeneration` (a parameter of the
    robot) of the net surplus, and the brake resistor dissipates the rest."""

    mode: Literal["shared"] = described(
        "Surplus feeds the other joints; the rest is dissipated.", None, "shared"
    )


class IsolatedBus(Request):
    """Every joint dissipates its own surplus."""

    mode: Literal["isolated"] = described(
        "The surplus of a joint feeds no other joint.", None, "isolated"
    )


class RecuperatingBus(Request):
    """Joints exchange power. The supply takes back a fraction of the net surplus."""

    mode: Literal["recuperating"] = described(
        "Surplus feeds the other joints; the rest is fed back to the supply.", None, "recuperating"
    )
    efficiency: Share = described(
        "Fraction of the net surplus that the supply takes back.", "1", 0.8
    )


class StorageBus(Request):
    """Joints exchange power. The net surplus charges an energy storage on the bus (capacitor or
    flywheel), and the storage feeds later demand. Surplus beyond the capacity or the power of the
    storage is treated as on the shared bus."""

    mode: Literal["storage"] = described(
        "Surplus feeds the other joints; the rest charges the energy storage.", None, "storage"
    )
    capacity: float = described(
        "Energy that the full storage can deliver.", "J", 30.0, ge=0, le=1e9
    )
    power: Annotated[float, Field(gt=0, le=1e9)] | None = described(
        "Largest charging and discharging power, at the bus. Null: no limit.",
        "W",
        500.0,
        default=None,
    )
    efficiency: Share = described(
        "Round-trip efficiency; the loss occurs while charging.", "1", 0.9, default=1.0
    )
    initial: float = described(
        "Charge at the start, at most `capacity`. The charge that the motion uses is added to the "
        "total.",
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
        custom_error_message="Give an object whose `mode` is shared, isolated, recuperating or "
        "storage",
    ),
]


class ArmRequest(CellRequest):
    """The arm with its payload, limits, drives, power bus, and surroundings."""

    figures: FiguresId | None = described(
        "Id of figures that were identified on one arm of this robot, from `GET /figures`. Null: "
        "the robot's own.",
        None,
        FIGURES_ID,
        default=None,
    )
    payload: Payload | None = described(
        "Payload at the flange. Null: no payload.",
        None,
        {"mass": 2.0, "com": [0.0, 0.0, 0.05]},
        default=None,
    )
    gravity: (
        Annotated[list[Annotated[float, Field(ge=-100, le=100)]], Field(min_length=3, max_length=3)]
        | None
    ) = described(
        "Acceleration of gravity, [x, y, z] in the robot's base frame (`base`). For a ceiling "
        "mount: [0, 0, 9.81]. Null: [0, 0, -9.81], or the robot's `kinematics.gravity`, for a "
        "robot of yours whose base is tilted in its URDF.",
        "m/s²",
        [0.0, 0.0, -9.81],
        default=None,
    )
    limits: Limits = described(
        "Limits of this request. They may only tighten the robot's limits.",
        None,
        {"velocity": 2.0},
        default=Limits(),
    )
    friction: Annotated[str, Field(min_length=1, max_length=64)] | None = described(
        "Name of one of the robot's friction models, from `GET /robots/{name}`. Null: its default "
        "model.",
        None,
        "curved",
        default=None,
    )
    drives: Drives = described(
        "Parameters of the drives that replace the robot's own.",
        None,
        {"inverter": {"constant": 1.5}},
        default=Drives(),
    )
    bus: Bus = described(
        "What happens to the surplus power of the joints.",
        None,
        {"mode": "storage", "capacity": 30.0, "power": 500.0, "efficiency": 0.9},
        default=SharedBus(mode="shared"),
    )
    link_mass_scale: ScalePerJoint = described(
        "Factor on mass and inertia of the link that a joint moves: one number, or one per joint. "
        "Payload and rotors do not change.",
        "1",
        0.8,
        default=1.0,
    )
    collisions: bool = described(
        "Whether collisions are checked. If false, `tool`, `payload.shape` and `scene` have no "
        "effect. Use false for motions that are known to be collision-free but that the capsules "
        "of the links are too coarse to allow.",
        None,
        True,
        default=True,
    )
    tool_cone: ToolCone | None = described(
        "Limits the angle between an axis of the tool and a direction during the whole motion, for "
        "example for an open glass. Null: no limit.",
        None,
        {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.2},
        default=None,
    )
