"""Capsules of a URDF's links, in the frames of the links that they move with.

A link has the capsules that the user gives, else one around each of its `<collision>` shapes, meshes included as far as
their files were given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from models.own_arm.capsule_around import capsule_around
from models.own_arm.description import CapsuleRow, Description, InvalidArm
from models.own_arm.mesh_files import corners
from models.own_arm.robot_xml import number, numbers
from models.own_arm.upright import UprightChain
from models.own_arm.urdf_chain import ORIGIN, Chain
from models.robot import Array

# largest mesh of a link, and farthest place of a shape from its joint [m]: files in millimetres need a scale
LARGEST, FARTHEST = 5.0, 50.0

Rows = list[list[float]]
"""Of each capsule the ends of its axis and the radius, as in a robot's figures [m]."""
Around = tuple[Array, float]
"""Ends (2, 3) of the axis and radius of a capsule [m]."""


@dataclass(frozen=True)
class LinkShapes:
    """The links of a chain; `missing` are the files of meshes that were asked for and not given."""

    chain: Chain
    upright: UprightChain
    capsules: Mapping[str, Sequence[CapsuleRow]]
    meshes: Mapping[str, bytes]
    missing: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, description: Description, chain: Chain, upright: UprightChain) -> LinkShapes:
        """The links of a description. Raises InvalidArm for capsules of a link that the arm does not have."""
        given = description.collision.capsules or {}
        if unknown := [name for name in given if not any(name in rigid for rigid in chain.rigid)]:
            raise InvalidArm("collision.capsules", f"The arm has no link {unknown[0]!r} from base to tip.")
        return cls(chain, upright, given, description.meshes or {})

    def rows(self, k: int) -> Rows:
        """Capsules of all that moves with link k, 0 for the base. Raises InvalidArm."""
        given = [row for link in self.chain.rigid[k] for row in self._given(k, link)]
        of_urdf = [row for link in self.chain.rigid[k] if link not in self.capsules for row in self._of_urdf(k, link)]
        return given + of_urdf

    def _given(self, k: int, link: str) -> Rows:
        """The user's capsules of a URDF link."""
        rows = self.capsules.get(link, ())
        for row in rows:
            if not 0 < row[6] < 1 or not np.isfinite(row).all():
                raise InvalidArm(
                    "collision.capsules", f"A capsule of {link!r} must have a radius above 0 and below 1 m."
                )
        return [_placed(self._frame(k, link), (np.array(row[:6]).reshape(2, 3), row[6])) for row in rows]

    def _of_urdf(self, k: int, link: str) -> Rows:
        """A capsule around each collision shape of a URDF link."""
        element = next(each for each in self.chain.root.findall("link") if each.get("name") == link)
        frame, rows = self._frame(k, link), list[list[float]]()
        for shape in element.findall("collision"):
            where = f"A <collision> of link {link!r} has"
            geometry = shape.find("geometry")
            around = None if geometry is None else self._around(geometry, where)
            if around is not None:
                rows.append(_placed(frame * _origin(shape.find("origin"), where), around))
        return rows

    def _around(self, geometry: Element, where: str) -> Around | None:
        """The capsule around a shape, in its frame; None for a shape that is not known, or not there."""
        if (sphere := geometry.find("sphere")) is not None:
            return np.zeros((2, 3)), number(sphere, "radius", f"{where} a <sphere>")
        if (cylinder := geometry.find("cylinder")) is not None:
            half = number(cylinder, "length", f"{where} a <cylinder>") / 2
            return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), number(cylinder, "radius", f"{where} a <cylinder>")
        if (box := geometry.find("box")) is not None:
            sides = numbers(box, "size", f"{where} a <box>") / 2
            longest = int(np.argmax(sides))
            axis = np.eye(3)[longest] * sides[longest]
            return np.array([-axis, axis]), float(np.linalg.norm(np.delete(sides, longest)))
        mesh = geometry.find("mesh")
        return None if mesh is None else self._around_mesh(mesh, f"{where} a <mesh>")

    def _around_mesh(self, mesh: Element, where: str) -> Around | None:
        points = corners(self.meshes, mesh.get("filename", ""))
        if points is None:
            self.missing.append(mesh.get("filename", ""))
            return None
        points = points * numbers(mesh, "scale", where, "1 1 1")
        if not np.ptp(points, axis=0).max() < LARGEST:
            raise InvalidArm("meshes", f"{where} larger than {LARGEST:g} m: has the URDF its `scale`?")
        return capsule_around(points)

    def _frame(self, k: int, link: str) -> pin.SE3:
        """The frame of a URDF link in that of the link k that it moves with."""
        model = self.chain.model
        placement = model.frames[model.getFrameId(link, pin.FrameType.BODY)].placement
        own = pin.SE3(self.chain.T_base) if k == 0 else pin.SE3(self.upright.R[k], np.zeros(3))
        return own.inverse() * placement


def check_near(name: str, rows: Rows) -> None:
    """Raises InvalidArm for capsules of a link that are far away, or nowhere: the origin of a joint or a shape is."""
    if not (np.abs(np.array(rows)) < FARTHEST).all():
        raise InvalidArm("urdf", f"The shape of link {name!r} is farther than {FARTHEST:g} m from its joint.")


def _placed(T: pin.SE3, around: Around) -> list[float]:
    axis, radius = around
    return [*(axis @ T.rotation.T + T.translation).ravel().tolist(), float(radius)]


def _origin(element: Element | None, where: str) -> pin.SE3:
    xyz, rpy = (numbers(element, part, f"{where} an <origin>", ORIGIN) for part in ("xyz", "rpy"))
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
