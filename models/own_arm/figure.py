"""One figure of a robot: value, unit, source, trust letter and note."""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.models.own_arm.description import PLAUSIBLE, Description, InvalidArm, PerJoint
from joulepath.models.robot import Array


def stated(description: Description, value: Any, unit: str, note: str) -> dict[str, Any]:
    """A figure of the URDF or description, with the user's source and trust letter."""
    return _figure(value, unit, description.source, description.trust, note)


def assumed(value: Any, unit: str, note: str) -> dict[str, Any]:
    """An engineering default."""
    return _figure(value, unit, "none: engineering default", "E", note)


def either(
    description: Description, given: Any, default: Any, unit: str, notes: tuple[str, str]
) -> dict[str, Any]:
    """The user's figure, or the default if it is None; `notes` has the note of each."""
    if given is None:
        return assumed(default, unit, notes[1])
    return stated(description, given, unit, notes[0])


def per_joint(
    field: str, given: PerJoint | None, joints: tuple[str, ...], zero: bool = False
) -> Array | None:
    """Values (nq,) of all joints; None stays None.

    Args:
        field: the field of the description, for the error.
        given: one number for all joints, or one per joint.
        joints: names of the joints.
        zero: whether 0 is allowed, beside the range from PLAUSIBLE.least to PLAUSIBLE.most.

    Raises:
        InvalidArm: a value is out of range; the error names the joint.
    """
    if given is None:
        return None
    values = np.array(given, dtype=float)
    if values.ndim and values.shape != (len(joints),):
        raise InvalidArm(
            field,
            f"{field} must be one number or a list of {len(joints)}, one per joint: "
            f"{', '.join(joints)}.",
        )
    values = np.broadcast_to(values, len(joints))
    for value, joint in zip(values, joints, strict=True):
        if not (PLAUSIBLE.least <= value <= PLAUSIBLE.most or (zero and value == 0)):
            least = "0, or from " if zero else "from "
            raise InvalidArm(
                field,
                f"{field} of joint {joint!r} must be {least}{PLAUSIBLE.least:g} to "
                f"{PLAUSIBLE.most:g}.",
            )
    return np.asarray(values)


def _figure(value: Any, unit: str, source: str, trust: str, note: str) -> dict[str, Any]:
    plain = value.tolist() if isinstance(value, np.ndarray) else value
    return {"value": plain, "unit": unit, "source": source, "trust": trust, "note": note}
