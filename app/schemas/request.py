"""What `POST /optimize` takes."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from app.schemas.common import IDENTITY, JointPositions, Pose, Request, RobotName, Vector3, by_field, described
from app.schemas.orientation import TargetPose
from optimizer.problem import Method

MAX_DURATION = 600.0
"""Longest motion [s]."""
MAX_SAMPLES = 100_000
"""Most samples that an answer holds."""

# with less, a motion would last longer than any answer may
Rate = Annotated[float, Field(ge=1e-2, le=1e6)]
Seconds = Annotated[float, Field(ge=1e-3, le=MAX_DURATION)]
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


class JointTarget(Request):
    """A target in joint space."""

    q: JointPositions = described("Joint positions from base to flange.", "rad", [0.0, -1.57, 1.57, -1.57, -1.57, 0.0])


class PoseTarget(Request):
    """A target in space: every arm configuration that reaches it is a candidate."""

    pose: TargetPose = described(
        "Pose of the TCP in the robot's base frame. A goal's orientation may be free in part.",
        None,
        {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]},
    )


SingleTarget = Annotated[
    Annotated[JointTarget, Tag("by q")] | Annotated[PoseTarget, Tag("by pose")], by_field("q", "pose")
]


class AnyOfTarget(Request):
    """Several targets: the one that costs least is taken."""

    any_of: list[SingleTarget] = described(
        "The targets, joints or poses, in any mixture. Those out of reach are listed in the answer's `unreachable`.",
        None,
        [
            {"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
            {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
        ],
        min_length=1,
        max_length=64,
    )


Target = Annotated[
    Annotated[JointTarget, Tag("by q")]
    | Annotated[PoseTarget, Tag("by pose")]
    | Annotated[AnyOfTarget, Tag("by any_of")],
    by_field("q", "pose", "any_of"),
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


class DurationRange(Request):
    """Bounds on the duration; either may be left out."""

    min: Seconds | None = described("Shortest duration.", "s", 1.0, default=None)
    max: Seconds | None = described("Longest duration.", "s", 3.0, default=None)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.min is not None and self.max is not None and self.min > self.max:
            raise PydanticCustomError("range", "`min` must not exceed `max`")
        return self


def _by_kind(value: Any) -> str | None:
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return "seconds"
    return "range" if isinstance(value, dict | DurationRange) else None


Duration = Annotated[
    Annotated[Seconds, Tag("seconds")] | Annotated[DurationRange, Tag("range")],
    Discriminator(
        _by_kind,
        custom_error_type="duration",
        custom_error_message="Give null, a number of seconds, or an object with `min`, `max` or both",
    ),
]


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


class Branch(Request):
    """Arm configurations to keep to; a part left out is free."""

    shoulder: Literal["left", "right"] | None = described(
        "Side of the shoulder that the arm is on.", None, "left", default=None
    )
    elbow: Literal["up", "down"] | None = described("Elbow above or below.", None, "up", default=None)
    wrist: Literal["flip", "no_flip"] | None = described("Wrist flipped or not.", None, "no_flip", default=None)


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


class Cycle(Request):
    """When the arm is needed again after the motion's start, and how it is held still until then."""

    time: Seconds = described(
        "From the start of the motion to the end of the wait: the motion takes no longer.", "s", 6.0
    )
    hold: Literal["motors", "brakes"] = described(
        "Whether the motors hold the arm all the time, or the brakes after `brake_delay`.",
        None,
        "brakes",
        default="motors",
    )
    brake_delay: float = described(
        "Time from the motion's end until the brakes hold.", "s", 0.5, default=0.0, ge=0, le=MAX_DURATION
    )
    brake_power: Annotated[float, Field(ge=0, le=1e4)] | None = described(
        "What the arm draws on its brakes, electronics included. Null: what the electronics draw.",
        "W",
        20.0,
        default=None,
    )


class ArmRequest(Request):
    """What every request about a motion says of the arm."""

    robot: RobotName = described("A name from `GET /robots`.", None, "ur5e", default="ur5e")
    tcp: Pose = described(
        "Pose of the TCP in the flange frame.",
        None,
        {"position": [0.0, 0.0, 0.12], "rpy": [0.0, 0.0, 0.0]},
        default=IDENTITY,
    )
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


class MotionRequest(ArmRequest):
    """A motion from rest at `start` to rest at `goal`."""

    start: Target = described(
        "Where the motion starts: joints, a pose, or any of several.",
        None,
        {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    )
    goal: Target = described(
        "Where it ends: joints, a pose, or any of several.",
        None,
        {"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
    )
    objective: Literal["electrical", "mechanical"] = described(
        "What is minimised: energy drawn from the bus, or the joints' absolute mechanical work.",
        None,
        "electrical",
        default="electrical",
    )
    duration: Duration | None = described(
        "Duration, or its bounds. Null lets the optimiser choose (`mechanical` then needs a number or a `max`: it has "
        f"no best duration of its own). At most {MAX_DURATION:g} s, and {MAX_SAMPLES} times `sample_period`.",
        "s",
        {"max": 3.0},
        default=None,
    )
    cycle: Cycle | None = described(
        "Wait at the goal until the cycle is over; the energy then includes the wait. Null: the motion alone.",
        None,
        {"time": 6.0, "hold": "brakes", "brake_delay": 0.5, "brake_power": 20.0},
        default=None,
    )
    branch: Branch | None = described(
        "Arm configurations to keep to. Null: try them all.",
        None,
        {"shoulder": "left", "elbow": "up", "wrist": "no_flip"},
        default=None,
    )
    windings: bool = described(
        "Whether to also try goals a full turn away, where the joint range allows.", None, True, default=True
    )
    sample_period: float = described(
        "Time between the returned samples; the last sample lies on the end.", "s", 0.008, default=0.008, ge=1e-4, le=1
    )
    deadline: float = described(
        "Wall time, waiting included, after which the best verified result so far is returned.",
        "s",
        10.0,
        default=10.0,
        ge=1e-3,
        le=MAX_DURATION,
    )

    @model_validator(mode="after")
    def _few_enough_samples(self) -> Self:
        longest = self.duration.max or self.duration.min if isinstance(self.duration, DurationRange) else self.duration
        if longest is not None and longest > self.sample_period * MAX_SAMPLES:
            raise PydanticCustomError(
                "too_many_samples",
                "`duration` divided by `sample_period` must be at most {most}: lengthen `sample_period`",
                {"most": MAX_SAMPLES},
            )
        return self


class OptimizeRequest(MotionRequest):
    """A motion from rest at `start` to rest at `goal`, by one method."""

    method: Method = described(
        "How the motion is parametrised. `bspline`: every joint a free B-spline. `time_scaling`: the straight line in "
        "joint space with an optimised time law. `lagrange`: every joint one polynomial, by its values at Chebyshev "
        "nodes. `uniform_scaling`: the time-optimal motion slowed evenly. `polynomial_ga`: one polynomial each, bred "
        "by a genetic algorithm over the three likeliest candidates: seconds, and never `optimal`.",
        None,
        "bspline",
        default="bspline",
    )
