"""The URDF of a robot from its figures: revolute joints about z, from `base` to `flange`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from joulepath.models.coupling import Array, Coupling

BASE = "base"
FLANGE = "flange"


def urdf_of(name: str, figures: dict[str, Any]) -> str:
    """The URDF text. Raises ValueError if an array does not have one entry per joint.

    A joint turns about the z axis of its frame, whose origin is given in the previous link frame.
    The root link is `base`, the last link `flange`. A joint that follows another has a <mimic>, and
    the limits of the other one times the multiplier.
    """
    kinematics, inertials, limits = figures["kinematics"], figures["inertials"], figures["limits"]
    coupling = coupling_of(kinematics)
    links = kinematics["link_names"]["value"]
    robot = Element("robot", name=name)
    SubElement(robot, "link", name=BASE)
    columns = (
        [BASE, *links[:-1]],
        links,
        kinematics.get("turning_joint_names", kinematics["joint_names"])["value"],
        kinematics["joint_origin"]["value"],
        *(
            inertials[part]["value"]
            for part in ("mass", "center_of_mass", "inertia_frame_rpy", "inertia")
        ),
        *_limits(limits, coupling),
    )
    joints = list[Element]()
    for (
        parent,
        child,
        joint,
        origin,
        mass,
        com,
        rpy,
        inertia,
        lower,
        upper,
        velocity,
        torque,
    ) in zip(*columns, strict=True):
        element = _joint(robot, joint, "revolute", parent, child, origin)
        SubElement(element, "axis", xyz="0 0 1")
        bounds = {"lower": lower, "upper": upper, "velocity": velocity, "effort": torque}
        SubElement(element, "limit", {key: repr(float(value)) for key, value in bounds.items()})
        joints.append(element)
        _link(robot, child, mass, [*com, *rpy], inertia)
    for place, (leader, multiplier, offset) in enumerate(coupling.rows):
        if leader != place:
            law = {"multiplier": repr(multiplier), "offset": repr(offset)}
            SubElement(joints[place], "mimic", {"joint": joints[leader].get("name", ""), **law})
    _joint(robot, "flange_joint", "fixed", links[-1], FLANGE, kinematics["flange_origin"]["value"])
    SubElement(robot, "link", name=FLANGE)
    return ElementTree.tostring(robot, encoding="unicode", xml_declaration=True)


def coupling_of(kinematics: dict[str, Any]) -> Coupling:
    """The coupling of a chain's joints in the section `kinematics` of figures."""
    rows = kinematics["coupling"]["value"] if "coupling" in kinematics else ()
    return Coupling(tuple((int(place), float(k), float(shift)) for place, k, shift in rows))


def _limits(limits: dict[str, Any], coupling: Coupling) -> Array:
    """Least and greatest position, speed and torque (4, n) of all joints of the chain."""
    lower, upper, velocity, torque = (
        np.array(limits[part]["value"])
        for part in ("position_min", "position_max", "velocity", "torque")
    )
    ends = np.sort([coupling.positions(lower), coupling.positions(upper)], axis=0)
    return np.array([*ends, np.abs(coupling.rates(velocity)), coupling.of_links(torque)])


def _joint(
    robot: Element, name: str, kind: str, parent: str, child: str, origin: Sequence[float]
) -> Element:
    element = SubElement(robot, "joint", name=name, type=kind)
    SubElement(element, "parent", link=parent)
    SubElement(element, "child", link=child)
    _origin(element, origin)
    return element


def _link(
    robot: Element, name: str, mass: float, origin: Sequence[float], inertia: Sequence[float]
) -> None:
    body = SubElement(SubElement(robot, "link", name=name), "inertial")
    _origin(body, origin)
    SubElement(body, "mass", value=repr(float(mass)))
    entries = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), inertia, strict=True)
    SubElement(body, "inertia", {key: repr(float(value)) for key, value in entries})


def _origin(element: Element, origin: Sequence[float]) -> None:
    """An origin: x, y, z [m], then roll, pitch, yaw [rad] about fixed axes."""
    x, y, z, roll, pitch, yaw = (repr(float(value)) for value in origin)
    SubElement(element, "origin", xyz=f"{x} {y} {z}", rpy=f"{roll} {pitch} {yaw}")
