"""URDFs of one arm in other conventions: senses and zero positions of joints, and link frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Robot

Figure = Callable[[float], str]


@dataclass(frozen=True, eq=False)
class Convention:
    """Joint positions q of the arm are senses * q_file + zeros [rad].

    `frames` (nq + 1, 3, 3) are the axes of the file's link frames in the arm's, base first.
    """

    senses: Array
    zeros: Array
    frames: Array

    def file(self, q: Array) -> Array:
        """Joint positions (..., nq) [rad] of the file."""
        return np.asarray(self.senses * (q - self.zeros))


def right_angled(nq: int, rng: np.random.Generator) -> Convention:
    """A designer's convention: zero positions and frames at quarter turns."""
    frames = [np.eye(3), *(_quarters(rng) for _ in range(nq))]
    zeros = rng.integers(-1, 3, nq) * np.pi / 2
    return Convention(rng.choice([-1.0, 1.0], nq), zeros, np.array(frames))


def inclined(nq: int, rng: np.random.Generator) -> Convention:
    """The convention of `right_angled`, with every second link's frames inclined by a multiple of
    15°.
    """
    designed = right_angled(nq, rng)
    angles = rng.integers(1, 24, nq + 1) * (np.arange(nq + 1) % 2) * np.pi / 12
    turns = [pin.exp3(angle * np.eye(3)[rng.integers(3)]) for angle in angles]
    return Convention(designed.senses, designed.zeros, designed.frames @ turns)


def drawn(robot: Robot, convention: Convention, figure: Figure = repr) -> str:
    """URDF of the robot in a convention; `figure` writes the angles of origins."""
    model, nq = robot.model, robot.nq
    frames = [pin.SE3(each, np.zeros(3)) for each in convention.frames]
    root = Element("robot", name="drawn")
    SubElement(root, "link", name="base")
    limits = [convention.file(each) for each in (robot.limits.q_min, robot.limits.q_max)]
    for k in range(1, nq + 1):
        zero = pin.SE3(pin.exp3(convention.zeros[k - 1] * np.array([0.0, 0.0, 1.0])), np.zeros(3))
        joint = _joint(
            root, k, frames[k - 1].inverse() * model.jointPlacements[k] * zero * frames[k], figure
        )
        axis = convention.senses[k - 1] * convention.frames[k][2]
        SubElement(joint, "axis", xyz=" ".join(repr(float(each)) for each in axis.round(15)))
        bounds = {
            "lower": min(limits[0][k - 1], limits[1][k - 1]),
            "upper": max(limits[0][k - 1], limits[1][k - 1]),
            "velocity": robot.limits.v_max[k - 1],
            "effort": robot.limits.tau_max[k - 1],
        }
        SubElement(joint, "limit", {name: repr(float(each)) for name, each in bounds.items()})
        _link(root, f"link_{k}", frames[k].actInv(model.inertias[k]))
    flange = frames[nq].inverse() * pin.SE3(robot.T_last_flange)
    _joint(root, nq + 1, flange, figure, "fixed")
    SubElement(root, "link", name=f"link_{nq + 1}")
    return ElementTree.tostring(root, encoding="unicode")


def _joint(
    root: Element, k: int, origin: pin.SE3, figure: Figure, kind: str = "revolute"
) -> Element:
    joint = SubElement(root, "joint", name=f"joint_{k}", type=kind)
    SubElement(joint, "parent", link=f"link_{k - 1}" if k > 1 else "base")
    SubElement(joint, "child", link=f"link_{k}")
    rpy = pin.rpy.matrixToRpy(origin.rotation.round(15))
    SubElement(
        joint,
        "origin",
        xyz=" ".join(repr(float(each)) for each in origin.translation.round(15)),
        rpy=" ".join(figure(float(each)) for each in rpy),
    )
    return joint


def _link(root: Element, name: str, body: pin.Inertia) -> None:
    inertial = SubElement(SubElement(root, "link", name=name), "inertial")
    SubElement(inertial, "origin", xyz=" ".join(repr(float(each)) for each in body.lever))
    SubElement(inertial, "mass", value=repr(float(body.mass)))
    tensor = body.inertia
    entries = zip(
        ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
        tensor[np.triu_indices(3)],
        strict=True,
    )
    SubElement(inertial, "inertia", {name: repr(float(each)) for name, each in entries})


def _quarters(rng: np.random.Generator) -> Array:
    """One of the rotations by quarter turns about the axes."""
    turns = rng.integers(0, 4, 3) * np.pi / 2
    return np.asarray(pin.rpy.rpyToMatrix(*turns)).round()
