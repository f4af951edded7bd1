"""Checks of the moving and of the held joints of a URDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element

from joulepath.models.own_arm.description import PLAUSIBLE, InvalidArm
from joulepath.models.own_arm.robot_xml import ZERO, numbers
from joulepath.models.own_arm.urdf_tree import (
    FIXED,
    TURNING,
    UrdfTree,
    joint_axis,
    joint_end,
    joint_limit,
    joint_range,
    listed,
    name_of,
)


def check_held(tree: UrdfTree, name: str) -> None:
    """Raises InvalidArm unless a joint exists and a single position can hold it."""
    if name not in tree.joints:
        raise InvalidArm(
            "locked",
            f"There is no joint {name!r} in the URDF: its joints are {listed(tree.joints)}.",
        )
    kind = tree.joints[name].get("type")
    if kind in ("floating", "planar"):
        raise InvalidArm(
            "locked",
            f"Joint {name!r} is {kind}, so no single position can hold it: make it fixed instead.",
        )


def check_place(joint: Element) -> None:
    """Raises InvalidArm for an origin or an axis of a joint without finite numbers."""
    where = f"Joint {name_of(joint)!r} has an <origin>"
    for part in ("xyz", "rpy"):
        numbers(joint.find("origin"), part, where, ZERO)
    if joint.get("type") != FIXED:
        joint_axis(joint)


def check_turning(joint: Element, moving: Sequence[Element], holds_others: bool) -> None:
    """Raises InvalidArm unless a moving joint is revolute or continuous.

    Args:
        joint: the joint.
        moving: all moving joints from base to tip.
        holds_others: whether `locked` holds all joints beside the chain without naming them.
    """
    kind = str(joint.get("type"))[: PLAUSIBLE.name]
    if kind in TURNING:
        return
    remedy = "make it fixed"
    if kind == "prismatic":
        remedy = "give its position in `locked`"
        if holds_others:
            remedy += ', in place of "others", with the positions of all other held joints'
    if not any(each.get("type") in TURNING for each in moving[: moving.index(joint)]):
        remedy += f", or name {joint_end(joint, 'child')!r} as `base`"
    raise InvalidArm(
        "urdf", f"Joint {name_of(joint)!r} is {kind}: only revolute joints can move: {remedy}."
    )


def check_range(joint: Element) -> None:
    """Raises InvalidArm unless a revolute joint has position limits or mimics another joint."""
    name, kind = name_of(joint), joint.get("type")
    if joint.find("mimic") is not None:
        return
    limit = joint.find("limit")
    if kind == "revolute" and (
        limit is None or "lower" not in limit.attrib or "upper" not in limit.attrib
    ):
        raise InvalidArm(
            "urdf",
            f"Joint {name!r} has no <limit> with `lower` and `upper`: add them, or make it "
            "continuous.",
        )
    ends = joint_limit(joint, "lower"), joint_limit(joint, "upper")
    if kind == "revolute" and not ends[0] < ends[1]:
        # Exporters write two zeros for a range without an entry.
        how = "exchange them" if ends[0] > ends[1] else "write its range, or make it continuous"
        raise InvalidArm(
            "urdf",
            f"Joint {name!r} cannot move, its lower limit being no less than the upper: {how}, or "
            "make it fixed.",
        )
    lower, upper, *_ = joint_range(joint)
    if not lower < upper:
        raise InvalidArm(
            "urdf",
            f"Joint {name!r} cannot move: its soft limits are exchanged, or beyond its <limit>.",
        )


def check_rest(tree: UrdfTree, moving: Sequence[Element], locked: Mapping[str, float]) -> None:
    """Raises InvalidArm if joints beside the chain move."""
    names = {name_of(joint): k for k, joint in enumerate(moving, start=1)}
    loose = [
        name
        for name, joint in tree.joints.items()
        if not (name in names or name in locked or joint.get("type") == FIXED)
        and tree.carrier(joint_end(joint, "parent"), names)
    ]
    if len(loose) == 1:
        raise InvalidArm(
            "locked",
            f"Joint {loose[0]!r} moves a link that is not between base and tip: give its "
            'position in `locked`, or "others" to hold it at zero.',
        )
    if loose:
        raise InvalidArm(
            "locked",
            f"Joints move links that are not between base and tip: {listed(loose)}. Give their "
            'positions in `locked`, or "others" to hold them all at zero.',
        )
