"""Figures of the joints of a URDF beside their axes: friction, damping, acceleration and jerk."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from joulepath.models.own_arm.description import Drives
from joulepath.models.own_arm.robot_xml import number
from joulepath.models.own_arm.rules import RULES
from joulepath.models.own_arm.urdf_tree import (
    CONTINUOUS,
    READ,
    REPEATED,
    joint_limit,
    listed,
    name_of,
    soft_range,
)
from joulepath.models.robot import Array


@dataclass(frozen=True)
class JointFacts:
    """Figures of moving joints, arrays of shape (nq,); 0 if the URDF has none.

    `acceleration` [rad/s²] and `jerk` [rad/s³] are limits of URDF 1.2, the lesser of `acceleration`
    and `deceleration`. `coulomb` [N·m] and `viscous` [N·m·s/rad] are `friction` and `damping` of
    <dynamics>. `soft` are the names of joints whose soft limits are tighter than their range, and
    `ignored` the other elements of the URDF, `endless` the continuous joints with a range.
    """

    acceleration: Array
    jerk: Array
    coulomb: Array
    viscous: Array
    soft: tuple[str, ...]
    ignored: tuple[str, ...]
    endless: tuple[str, ...]

    @staticmethod
    def of(root: Element, joints: tuple[str, ...]) -> JointFacts:
        """Facts of the joints with these names. Raises InvalidArm for attributes without a
        number.
        """
        by_name = {name_of(joint): joint for joint in root.findall("joint")}
        moving = [by_name[name] for name in joints]
        acceleration, deceleration, jerk = (
            _column(moving, "limit", part) for part in ("acceleration", "deceleration", "jerk")
        )
        both = np.minimum(acceleration, deceleration)
        return JointFacts(
            np.where(both > 0, both, np.maximum(acceleration, deceleration)),
            jerk,
            _column(moving, "dynamics", "friction"),
            _column(moving, "dynamics", "damping"),
            tuple(name_of(joint) for joint in moving if _is_softly_limited(joint)),
            tuple(sorted(_without_effect(root))),
            tuple(name_of(joint) for joint in moving if _has_ends_without_effect(joint)),
        )

    def warnings(self, given: Drives, joints: tuple[str, ...], ruling: Array) -> list[str]:
        """Warnings of implausible friction, and of elements without effect.

        Args:
            given: figures of the drives; they replace the figures of the URDF.
            joints: names of the joints.
            ruling: torques (nq,) [N·m] from which missing friction is ruled.
        """
        found = list[str]()
        for attribute, field, own, ruled in (
            ("friction", "coulomb", self.coulomb, RULES.coulomb * ruling),
            ("damping", "viscous", self.viscous, RULES.viscous * ruling),
        ):
            least, most = RULES.likely_friction
            doubtful = (own > 0) & ((own < least * ruled) | (own > most * ruled))
            if getattr(given, field) is None and doubtful.any():
                names = [name for name, each in zip(joints, doubtful, strict=True) if each]
                found.append(
                    f"Joints whose `{attribute}` in the URDF is far from that of common drives, "
                    f"and may be a simulator's placeholder: {listed(names)}. It is taken as "
                    f"written; give `drives.{field}` to replace it."
                )
        if self.ignored:
            found.append(f"Elements of the URDF without effect: {listed(self.ignored)}.")
        return found


def _without_effect(root: Element) -> set[str]:
    """Elements that are not read, such as `gazebo`, `calibration`, `second limit of elbow`, or soft
    limits of a joint that turns without end.
    """
    found = {part.tag for part in root if part.tag not in READ}
    for part in root:
        read, seen = READ.get(part.tag, ()), set[str]()
        for tag in (each.tag for each in part) if read else ():
            if tag not in read:
                found.add(tag)
            elif tag in seen and tag not in REPEATED:
                found.add(f"second {tag} of {name_of(part)}")
            seen.add(tag)
        if part.get("type") == "continuous" and _has_soft_limits(part):
            found.add(f"soft limits of {name_of(part)}")
    return found


def _has_soft_limits(joint: Element) -> bool:
    soft = joint.find("safety_controller")
    return soft is not None and not {"soft_lower_limit", "soft_upper_limit"}.isdisjoint(soft.keys())


def _is_softly_limited(joint: Element) -> bool:
    soft, limit = soft_range(joint), joint.find("limit")
    where = f"Joint {name_of(joint)!r} has a <limit>"
    return soft is not None and (
        soft[0] > number(limit, "lower", where, "0") or soft[1] < number(limit, "upper", where, "0")
    )


def _has_ends_without_effect(joint: Element) -> bool:
    lower, upper = (joint_limit(joint, part) for part in ("lower", "upper"))
    return joint.get("type") == "continuous" and -CONTINUOUS < lower < upper < CONTINUOUS


def _column(joints: list[Element], part: str, attribute: str) -> Array:
    """An attribute (nq,) of all joints, 0 if it is missing or not above 0."""
    values = [
        number(joint.find(part), attribute, f"Joint {name_of(joint)!r} has a <{part}>", "0")
        for joint in joints
    ]
    return np.maximum(values, 0.0)
