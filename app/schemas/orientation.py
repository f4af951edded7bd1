"""Poses with an orientation tolerance: allowed as a goal, beside full poses."""

from __future__ import annotations

from math import pi
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Tag
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.common import (
    AS_IN_ROS,
    BaseQuaternionPose,
    BaseRotvecPose,
    BaseRpyPose,
    InFrame,
    Positioned,
    Request,
    Vector3,
    WithQuaternion,
    WithRotvec,
    WithRpy,
    by_field,
    described,
)
from joulepath.app.schemas.examples.values import TURNED

SHORTEST_AXIS = 1e-6
"""Smallest length of an axis."""


def _has_direction(axis: list[float]) -> list[float]:
    if sum(part * part for part in axis) ** 0.5 < SHORTEST_AXIS:
        raise PydanticCustomError("zero_axis", "The axis must not have length zero")
    return axis


Axis = Annotated[Vector3, AfterValidator(_has_direction)]


class _FreeAbout(Request):
    free_about: Axis = described(
        "Axis of the tool in the TCP frame about which it may rotate freely; any length except "
        "zero.",
        "1",
        [0.0, 0.0, 1.0],
    )


class QuaternionFreeAbout(WithQuaternion, _FreeAbout):
    """An orientation, as a quaternion, rotated by any angle about an axis of the tool."""


class RpyFreeAbout(WithRpy, _FreeAbout):
    """An orientation, as roll, pitch, yaw, rotated by any angle about an axis of the tool."""


class RotvecFreeAbout(WithRotvec, _FreeAbout):
    """An orientation, as a rotation vector, rotated by any angle about an axis of the tool."""


class Cone(Request):
    """All orientations with an axis of the tool within an angle of a direction. The tool may rotate
    about this axis.
    """

    axis: Axis = described(
        "Axis of the tool in the TCP frame; any length except zero.", "1", [0.0, 0.0, 1.0]
    )
    direction: Axis = described(
        "Direction in the robot's base frame, or in the given `frame`; any length except zero.",
        "1",
        [0.0, 0.0, -1.0],
    )
    half_angle: float = described(
        "Largest allowed angle between `axis` and `direction`.", "rad", 0.35, ge=0, le=pi
    )


class InCone(Request):
    """An orientation with an axis of the tool in a cone."""

    cone: Cone = described(
        "Allowed directions of an axis of the tool.",
        None,
        {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.35},
    )


def _by_kind(value: Any) -> str | None:
    if isinstance(value, str):
        return "by word"
    names = ("cone", "free_about")
    present = [
        name
        for name in names
        if (name in value if isinstance(value, dict) else hasattr(value, name))
    ]
    return f"by {present[0]}" if len(present) == 1 else None


Orientation = Annotated[
    Annotated[Literal["free"], Tag("by word")]
    | Annotated[InCone, Tag("by cone")]
    | Annotated[
        Annotated[
            Annotated[QuaternionFreeAbout, Tag("by quaternion")]
            | Annotated[RpyFreeAbout, Tag("by rpy")]
            | Annotated[RotvecFreeAbout, Tag("by rotvec")],
            by_field("quaternion", "rpy", "rotvec"),
        ],
        Tag("by free_about"),
    ],
    Discriminator(
        _by_kind,
        custom_error_type="orientation",
        custom_error_message='Give "free", or an object with exactly one of cone, free_about',
    ),
]


class ConeOrientedPose(Positioned, InFrame):
    """A position with a partly free orientation."""

    orientation: Orientation = described(
        '"free": any orientation. `free_about`: a given orientation, rotated by any angle about an '
        "axis of the tool. "
        "`cone`: an axis of the tool within an angle of a direction, and any rotation about this "
        "axis.",
        None,
        {"cone": {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.35}},
    )


TargetPose = Annotated[
    Annotated[BaseQuaternionPose, Tag("by quaternion")]
    | Annotated[BaseRpyPose, Tag("by rpy")]
    | Annotated[BaseRotvecPose, Tag("by rotvec")]
    | Annotated[ConeOrientedPose, Tag("by orientation")],
    by_field("quaternion", "rpy", "rotvec", "orientation", beside="position", example=TURNED),
    AS_IN_ROS,
]
