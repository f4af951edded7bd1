"""Common base models, field helpers, vectors and poses of the schemas."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import islice
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    ModelWrapValidatorHandler,
    Tag,
    model_validator,
)
from pydantic_core import PydanticCustomError

from joulepath.app.answers.declared import with_unit
from joulepath.app.schemas.examples.values import TURNED
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.names import TYPOS, nearest
from joulepath.app.schemas.unknown_fields import without_unknown_fields
from joulepath.optimizer.problem.names import is_plain
from joulepath.optimizer.problem.pose import QUATERNION_TOLERANCE

KEY_HEADER = "Idempotency-Key"


def described(description: str, unit: str | None, example: Any, **constraints: Any) -> Any:
    """A field with its description, its unit (None: has no unit, "1": a plain number) and a
    realistic example.
    """
    extra: dict[str, Any] = {} if unit is None else {"x-unit": unit}
    return Field(
        description=with_unit(description, unit),
        examples=[example],
        json_schema_extra=extra,
        **constraints,
    )


def between(range: tuple[float, float]) -> dict[str, Any]:
    """The constraints of a number between the ends of a range."""
    least, most = range
    return {"ge": least, "le": most}


def part(description: str) -> Any:
    """A field of an answer with a model, or a list or dict of models, as its value; the examples
    are in the fields of the models.
    """
    return Field(description=description)


class Request(BaseModel):
    """A part of a request: no conversion of JSON types, no NaN or infinity, no unknown fields."""

    model_config = ConfigDict(
        extra="forbid", strict=True, allow_inf_nan=False, frozen=True, serialize_by_alias=True
    )

    @model_validator(mode="wrap")
    @classmethod
    def _refuse_unknown_fields(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        fields = [field.alias or name for name, field in cls.model_fields.items()]
        return without_unknown_fields(data, fields, handler)


class Response(BaseModel):
    """A part of an answer: every field is always present."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def by_field(
    *names: str, beside: str | None = None, example: Mapping[str, Any] | None = None
) -> Discriminator:
    """Discriminator of a union whose members are tagged `by <name>`: the object has exactly one
    field of `names`.

    `beside` is a field that all members have. The message of the error shows the `example`.
    """

    def choose(value: Any) -> str | None:
        present = [
            name
            for name in names
            if (name in value if isinstance(value, dict) else hasattr(value, name))
        ]
        if not present and isinstance(value, dict):
            # a misspelt name selects the member with the most similar name, for its error
            meant = (
                nearest(str(given), names, TYPOS.nearly_same)
                for given in islice(value, TYPOS.compared)
            )
            present = list(islice((name for name in meant if name is not None), 1))
        return f"by {present[0]}" if len(present) == 1 else None

    also = f"{beside} and " if beside else ""
    like = f", for example {json.dumps(example)}" if example else ""
    return Discriminator(
        choose,
        custom_error_type="exactly_one",
        custom_error_message=f"Give an object with {also}exactly one of {', '.join(names)}{like}",
    )


def _as_ros(value: Any) -> Any:
    """A pose of ROS, with or without a header, in the form of the schemas: `orientation: {x, y, z,
    w}` becomes `quaternion`, `position: {x, y, z}` a list, and `frame_id` the `frame`.
    """
    if isinstance(value, dict) and value.keys() == {"header", "pose"}:
        header, pose = value["header"], value["pose"]
        frame = header.get("frame_id") if isinstance(header, dict) else None
        if not isinstance(pose, dict) or frame not in ("base", "base_link", "/base", "/base_link"):
            raise PydanticCustomError(
                "stamped", "A stamped pose needs a `pose`, and the `frame_id` base or base_link"
            )
        value = pose | {"frame": frame.lstrip("/")}
    if not isinstance(value, dict):
        return value
    position, orientation = value.get("position"), value.get("orientation")
    if isinstance(position, dict) and position.keys() == {*"xyz"}:
        value = value | {"position": [position[part] for part in "xyz"]}
    if "quaternion" in value or not isinstance(orientation, dict):
        return value
    if orientation and orientation.keys() < {*"xyzw"}:
        raise PydanticCustomError("orientation", "A ROS orientation has each of x, y, z and w")
    if orientation.keys() == {*"xyzw"}:
        value = value | {"quaternion": [orientation[part] for part in "xyzw"]}
        del value["orientation"]
    return value


AS_IN_ROS = BeforeValidator(_as_ros)
"""Also takes geometry_msgs/Pose and PoseStamped as JSON."""


def number_or_object(number: str, error: str, message: str) -> Discriminator:
    """Discriminator of a union of a number, with the tag `number`, and an object, with the tag
    `range`; anything else is an error of type `error`.
    """

    def kind(value: Any) -> str | None:
        if isinstance(value, bool):
            return None
        if isinstance(value, int | float):
            return number
        return "range" if isinstance(value, dict | Request) else None

    return Discriminator(kind, custom_error_type=error, custom_error_message=message)


def _is_unit(quaternion: list[float]) -> list[float]:
    norm = sum(part * part for part in quaternion) ** 0.5
    if abs(norm - 1) > QUATERNION_TOLERANCE:
        raise PydanticCustomError(
            "not_unit", "The norm of the quaternion must be within 0.001 of 1"
        )
    return quaternion


def _plain(name: str) -> str:
    if not is_plain(name):
        raise PydanticCustomError(
            "plain",
            "The name is blank or has control or invisible characters: use letters, digits, signs "
            "and spaces",
        )
    return name


# the pattern shows a part of the rule in the schema: no control characters, which a database may
# reject, too
NO_CONTROLS = r"^[^\x00-\x1F\x7F-\x9F]+$"
PLAIN = AfterValidator(_plain)
"""Refuses a name with characters that do not show."""

Vector3 = Annotated[
    list[Annotated[float, Field(ge=-1e3, le=1e3)]], Field(min_length=3, max_length=3)
]
Quaternion = Annotated[
    list[Annotated[float, Field(ge=-1.1, le=1.1)]],
    Field(min_length=4, max_length=4),
    AfterValidator(_is_unit),
]
JointPositions = Annotated[
    list[Annotated[float, Field(ge=-1e3, le=1e3)]], Field(min_length=1, max_length=16)
]


class Positioned(Request):
    """The position of a frame."""

    position: Vector3 = described("Origin of the frame: [x, y, z].", "m", [0.4, -0.2, 0.3])


class WithQuaternion(Request):
    """An orientation as a quaternion."""

    quaternion: Quaternion = described(
        "Orientation as a quaternion [x, y, z, w]. Its norm must be within 0.001 of 1; it is then "
        "normalised. ROS's `orientation: {x, y, z, w}` is taken in its place, and a whole "
        "PoseStamped in place of the pose.",
        "1",
        [0.0, 1.0, 0.0, 0.0],
    )


class WithRpy(Request):
    """An orientation as roll, pitch, yaw."""

    rpy: Vector3 = described(
        "Orientation as [roll, pitch, yaw]: rotations about the fixed axes x, y, z, in this order.",
        "rad",
        [3.14159, 0.0, 1.5708],
    )


class WithRotvec(Request):
    """An orientation as a rotation vector."""

    rotvec: Vector3 = described(
        "Orientation as a rotation vector [rx, ry, rz]: axis times angle, as on the teach pendant.",
        "rad",
        [0.0, 3.14159, 0.0],
    )


class QuaternionPose(WithQuaternion, Positioned):
    """Position and unit quaternion."""


class RpyPose(WithRpy, Positioned):
    """Position and roll, pitch, yaw."""


class RotvecPose(WithRotvec, Positioned):
    """Position and rotation vector, as on the teach pendant."""


Pose = Annotated[
    Annotated[QuaternionPose, Tag("by quaternion")]
    | Annotated[RpyPose, Tag("by rpy")]
    | Annotated[RotvecPose, Tag("by rotvec")],
    by_field("quaternion", "rpy", "rotvec", beside="position", example=TURNED),
    AS_IN_ROS,
]

Frame = Literal["base", "base_link"]


def frame_of(what: str) -> Any:
    """The field `frame` of what is given in one of the two frames at the robot's base."""
    return described(
        f"Frame of {what}. `base`: the robot's base frame, as on the teach pendant and in every "
        "answer. `base_link`: the frame of this name in ROS. For Universal Robots it is `base` "
        "after half a turn about z, so x and y have the opposite sign. For a robot whose figures "
        "have no `base_link_origin`, the two are the same.",
        None,
        "base",
        default="base",
    )


class InFrame(Request):
    """A pose in one of the two frames at the robot's base."""

    frame: Frame = frame_of("the pose")


class BaseQuaternionPose(QuaternionPose, InFrame):
    """Position and unit quaternion in a frame of the robot's base."""


class BaseRpyPose(RpyPose, InFrame):
    """Position and roll, pitch, yaw in a frame of the robot's base."""


class BaseRotvecPose(RotvecPose, InFrame):
    """Position and rotation vector in a frame of the robot's base, by default the one of the teach
    pendant.
    """


BasePose = Annotated[
    Annotated[BaseQuaternionPose, Tag("by quaternion")]
    | Annotated[BaseRpyPose, Tag("by rpy")]
    | Annotated[BaseRotvecPose, Tag("by rotvec")],
    by_field("quaternion", "rpy", "rotvec", beside="position", example=TURNED),
    AS_IN_ROS,
]

IDENTITY = QuaternionPose(position=[0.0, 0.0, 0.0], quaternion=[0.0, 0.0, 0.0, 1.0])

ID_PATTERN = r"^[0-9a-f-]{36}$"
FiguresId = Annotated[str, Field(pattern=ID_PATTERN)]
RobotName = Annotated[str, Field(min_length=1, max_length=LENGTHS.robot)]


class RobotWithTcp(Request):
    """A robot and its tool centre point (TCP)."""

    robot: RobotName = described(
        "Name of the robot, from `GET /robots`.", None, "ur5e", default="ur5e"
    )
    tcp: Pose | None = described(
        "Pose of the TCP in the flange frame. Null: that of a tool that is given by name, or the "
        "flange.",
        None,
        {"position": [0.0, 0.0, 0.12], "rpy": [0.0, 0.0, 0.0]},
        default=None,
    )
