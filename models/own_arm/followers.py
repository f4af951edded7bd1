"""Joints of a URDF with a <mimic>: they follow held or moving joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from joulepath.models.coupling import Coupling
from joulepath.models.own_arm.description import PLAUSIBLE, InvalidArm, Problems
from joulepath.models.own_arm.robot_xml import number
from joulepath.models.own_arm.urdf_tree import UrdfTree, joint_range, name_of
from joulepath.models.robot import Array


@dataclass(frozen=True)
class Mimic:
    """Law of a follower: multiplier · position of the leader + offset [rad] or [m]."""

    leader: str
    multiplier: float
    offset: float

    @staticmethod
    def of(joint: Element) -> Mimic | None:
        """Law of a joint; None without a <mimic>. Raises InvalidArm."""
        mimic, where = joint.find("mimic"), f"Joint {name_of(joint)!r} has a <mimic>"
        if mimic is None:
            return None
        multiplier, offset = (
            number(mimic, "multiplier", where, "1"),
            number(mimic, "offset", where, "0"),
        )
        return Mimic(mimic.get("joint", ""), multiplier, offset)

    def at(self, position: float) -> float:
        """Position of the follower [rad] or [m]."""
        return self.multiplier * position + self.offset


def with_followers(tree: UrdfTree, held: Mapping[str, float], given: set[str]) -> dict[str, float]:
    """Positions [rad] or [m] of held joints and their followers. The positions of joints
    `given` by name stay.
    """
    positions, follows = dict(held), True
    mimics = {
        name: mimic
        for name, joint in tree.joints.items()
        if name not in given and (mimic := Mimic.of(joint)) is not None
    }
    while follows:
        follows = False
        for name, mimic in list(mimics.items()):
            if mimic.leader in positions and mimic.leader not in mimics:
                positions[name] = mimic.at(positions[mimic.leader])
                del mimics[name]
                follows = True
    return positions


def left_behind(tree: UrdfTree, names: Iterable[str], moving: Iterable[str]) -> list[str]:
    """The held joints among `names` with a moving leader in the URDF: of rods beside the
    chain, for example.
    """
    found, movers = list[str](), set(moving)
    for name in names:
        mimic = Mimic.of(tree.joints[name])
        if mimic is not None and mimic.leader in movers:
            found.append(name)
    return found


def coupling_of_joints(moving: Sequence[Element]) -> Coupling:
    """Coupling of the moving joints from base to tip. Raises InvalidArm."""
    names = {name_of(joint): place for place, joint in enumerate(moving)}
    mimics = {
        name: mimic for name, joint in zip(names, moving, strict=True) if (mimic := Mimic.of(joint))
    }
    rows, problems = list[tuple[int, float, float]](), Problems()
    for name in names:
        with problems.noted():
            rows.append(_row(name, names, mimics))
    problems.raise_any()
    return Coupling(tuple(rows) if mimics else ())


def _row(
    name: str, names: Mapping[str, int], mimics: Mapping[str, Mimic]
) -> tuple[int, float, float]:
    """Row of a joint in the coupling; a follower of a follower follows the latter's leader."""
    leader, multiplier, offset, passed = name, 1.0, 0.0, set[str]()
    while leader in mimics:
        mimic = mimics[leader]
        if leader in passed:
            raise InvalidArm(
                "urdf", f"Joint {name!r} mimics itself: one joint of the loop must not mimic."
            )
        if mimic.leader not in names:
            raise InvalidArm(
                "urdf",
                f"Joint {leader!r} mimics {mimic.leader!r}, which is not a moving joint between "
                f"base and tip: give the position of {leader!r} in `locked`.",
            )
        passed.add(leader)
        multiplier, offset = multiplier * mimic.multiplier, multiplier * mimic.offset + offset
        leader = mimic.leader
    if not PLAUSIBLE.least_multiplier <= abs(multiplier) <= 1 / PLAUSIBLE.least_multiplier:
        raise InvalidArm(
            "urdf",
            f"Joint {name!r} mimics {leader!r} with a multiplier of {multiplier:g}: its size must "
            f"be from {PLAUSIBLE.least_multiplier:g} to {1 / PLAUSIBLE.least_multiplier:g}. Make "
            "the joint fixed if it does not move.",
        )
    return names[leader], multiplier, offset


def coupled_ranges(moving: Sequence[Element], coupling: Coupling) -> Array:
    """Least and greatest position [rad], speed [rad/s] and torque [N·m] (nq, 4) of the joints that
    follow no other, within which their followers keep their own ranges and speeds.

    A follower that is continuous, or has no range, or no speed above 0, has no such limit of its
    own. Its effort is no limit either, as it has no motor.

    Raises:
        InvalidArm: a joint and its follower have no common range.
    """
    ranges = np.array([joint_range(joint) for joint in moving])
    if not coupling.follows:
        return ranges
    found = ranges[coupling.own]
    for place, (number_of, (leader, k, offset)) in enumerate(
        zip(coupling.leaders, coupling.rows, strict=True)
    ):
        lower, upper, speed, _ = ranges[place]
        if leader == place:
            continue
        row = found[number_of]
        if lower < upper and moving[place].get("type") != "continuous":
            ends = sorted(((lower - offset) / k, (upper - offset) / k))
            row[:2] = max(row[0], ends[0]), min(row[1], ends[1])
        if speed > 0:
            row[2] = min(row[2], speed / abs(k))
        if not row[0] < row[1]:
            names = name_of(moving[place]), name_of(moving[leader])
            raise InvalidArm(
                "urdf",
                f"Joint {names[0]!r} mimics {names[1]!r}, and within its own range the other one "
                f"cannot move: correct the <limit> or the <mimic> of {names[0]!r}.",
            )
    return found
