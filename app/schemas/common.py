"""What several schemas share: the base models, vectors and poses."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

KEY_HEADER = "Idempotency-Key"
QUATERNION_TOLERANCE = 1e-3
"""How far a quaternion's norm may be from 1 before it is refused."""


def described(description: str, unit: str | None, example: Any, **constraints: Any) -> Any:
    """A field with its description, its unit (None where it has none) and a realistic example."""
    extra: dict[str, Any] = {} if unit is None else {"x-unit": unit}
    text = description if unit in (None, "1") else f"{description} [{unit}]"
    return Field(description=text, examples=[example], json_schema_extra=extra, **constraints)


def part(description: str) -> Any:
    """A field of an answer that is a model, or a list or dict of one, whose own fields show what it looks like."""
    return Field(description=description)


class Request(BaseModel):
    """A part of a request: JSON types as they are, no NaN or infinity, no unknown fields."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_fields(cls, data: Any) -> Any:
        # ahead of `extra="forbid"`, whose error repeats the unknown name: nothing of the caller's input goes back
        if isinstance(data, dict) and not data.keys() <= cls.model_fields.keys():
            raise PydanticCustomError(
                "unknown_field", "There is an unknown field: use only {known}", {"known": ", ".join(cls.model_fields)}
            )
        return data


class Response(BaseModel):
    """A part of an answer: every field is always there."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def by_field(*names: str) -> Discriminator:
    """Chooses a union's member by which one of `names` the object has, for members tagged `by <name>`."""

    def choose(value: Any) -> str | None:
        present = [name for name in names if (name in value if isinstance(value, dict) else hasattr(value, name))]
        return f"by {present[0]}" if len(present) == 1 else None

    return Discriminator(
        choose,
        custom_error_type="exactly_one",
        custom_error_message=f"Give an object with exactly one of {', '.join(names)}",
    )


def _is_unit(quaternion: list[float]) -> list[float]:
    norm = sum(part * part for part in quaternion) ** 0.5
    if abs(norm - 1) > QUATERNION_TOLERANCE:
        raise PydanticCustomError("not_unit", "The quaternion must have norm 1, to within 0.001")
    return quaternion


Vector3 = Annotated[list[Annotated[float, Field(ge=-1e3, le=1e3)]], Field(min_length=3, max_length=3)]
Quaternion = Annotated[
    list[Annotated[float, Field(ge=-1.1, le=1.1)]], Field(min_length=4, max_length=4), AfterValidator(_is_unit)
]
JointPositions = Annotated[list[Annotated[float, Field(ge=-1e3, le=1e3)]], Field(min_length=1, max_length=16)]


class Positioned(Request):
    """The place of a frame."""

    position: Vector3 = described("Origin of the frame: x, y, z.", "m", [0.4, -0.2, 0.3])


class WithQuaternion(Request):
    """An orientation as a quaternion."""

    quaternion: Quaternion = described(
        "Orientation as a quaternion x, y, z, w: normalised if its norm is within 0.001 of 1, else refused.",
        "1",
        [0.0, 1.0, 0.0, 0.0],
    )


class WithRpy(Request):
    """An orientation as roll, pitch, yaw."""

    rpy: Vector3 = described(
        "Orientation as roll, pitch, yaw about the fixed axes x, y, z, in this order.", "rad", [3.14159, 0.0, 1.5708]
    )


class WithRotvec(Request):
    """An orientation as a rotation vector."""

    rotvec: Vector3 = described(
        "Orientation as a rotation vector: axis times angle, as on the teach pendant.", "rad", [0.0, 3.14159, 0.0]
    )


class QuaternionPose(WithQuaternion, Positioned):
    """Position and unit quaternion."""


class RpyPose(WithRpy, Positioned):
    """Position and roll, pitch, yaw."""


class RotvecPose(WithRotvec, Positioned):
    """Position and rotation vector, as the teach pendant shows it."""


Pose = Annotated[
    Annotated[QuaternionPose, Tag("by quaternion")]
    | Annotated[RpyPose, Tag("by rpy")]
    | Annotated[RotvecPose, Tag("by rotvec")],
    by_field("quaternion", "rpy", "rotvec"),
]

IDENTITY = QuaternionPose(position=[0.0, 0.0, 0.0], quaternion=[0.0, 0.0, 0.0, 1.0])

RobotName = Annotated[str, Field(min_length=1, max_length=64)]
