"""One figure: a value with its unit, source, trust letter and note, as a robot's file has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.models.own_arm.description import Description, InvalidArm, PerJoint
from joulepath.models.robot import Array

# no limit, inertia or friction of an arm is beyond these, in SI units
LEAST, MOST = 1e-6, 1e6


def stated(description: Description, value: Any, unit: str, note: str) -> dict[str, Any]:
    """A figure of the URDF, or of the description, whose source and letter the user states."""
    return _figure(value, unit, description.source, description.trust, note)


def assumed(value: Any, unit: str, note: str) -> dict[str, Any]:
    """A figure that nobody gave."""
    return _figure(value, unit, "none: engineering default", "E", note)


def either(
    description: Description, given: Any, default: Any, unit: str, notes: tuple[str, str]
) -> dict[str, Any]:
    """The figure that the user gave, or the default where it is None; `notes` on both."""
    if given is None:
        return assumed(default, unit, notes[1])
    return stated(description, given, unit, notes[0])


def per_joint(
    field: str, given: PerJoint | None, joints: tuple[str, ...], zero: bool = False
) -> Array | None:
    """One value (nq,) for each joint; None stays None.

    Raises InvalidArm, which names the joint, unless all are between LEAST and MOST, or 0 where
    `zero` allows it.
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
        if not (LEAST <= value <= MOST or (zero and value == 0)):
            least = "0, or from " if zero else "from "
            raise InvalidArm(
                field, f"{field} of joint {joint!r} must be {least}{LEAST:g} to {MOST:g}."
            )
    return np.asarray(values)


def _figure(value: Any, unit: str, source: str, trust: str, note: str) -> dict[str, Any]:
    plain = value.tolist() if isinstance(value, np.ndarray) else value
    return {"value": plain, "unit": unit, "source": source, "trust": trust, "note": note}
