"""Capsules of the links of a URDF, in the frames of the moving links.

A link has the user's capsules, or else one around each of its `<collision>` shapes. Meshes count if
their files were given.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin
from scipy.spatial import QhullError

from joulepath.models.hull_cover import hull_around
from joulepath.models.own_arm.capsule_around import capsule_around, outermost
from joulepath.models.own_arm.description import PLAUSIBLE, CapsuleRow, Description, InvalidArm
from joulepath.models.own_arm.mesh_files import corners
from joulepath.models.own_arm.robot_xml import ZERO, numbers
from joulepath.models.own_arm.upright import UprightChain
from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.robot import Array
from joulepath.models.shape_sizes import WrongSize, check_lengths, check_scale, check_surface
from joulepath.models.uploads.limits import LIMITS, Checkpoint

MOST_POINTS = 128
"""Most points of a hull: with more, distances take longer than those of a few capsules."""
SOLIDS = {
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "box": {"size": 3},
}
"""Lengths of the shapes other than meshes, each with its count of numbers."""
Rows = list[list[float]]
"""Capsules: both ends of the axis and the radius [m], as in the figures of a robot."""
Around = tuple[Array, float]
"""Ends (2, 3) of the axis and radius of a capsule [m]."""


@dataclass(frozen=True)
class LinkShapes:
    """Shapes of the links of a chain.

    `missing` collects the names of missing mesh files, `unknown` the unsupported kinds of shapes.
    """

    chain: Chain
    upright: UprightChain
    capsules: Mapping[str, Sequence[CapsuleRow]]
    meshes: Mapping[str, bytes]
    checkpoint: Checkpoint
    missing: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    _seen: list[str] = field(default_factory=list)
    _made: dict[tuple[str, str | None], Around] = field(default_factory=dict)
    _outermost: dict[tuple[str, str | None], Array] = field(default_factory=dict)

    @classmethod
    def of(
        cls, description: Description, chain: Chain, upright: UprightChain, checkpoint: Checkpoint
    ) -> LinkShapes:
        """The shapes of a description. Raises InvalidArm for capsules of an unknown link."""
        given = description.collision.capsules or {}
        if unknown := [name for name in given if not any(name in rigid for rigid in chain.rigid)]:
            raise InvalidArm(
                "collision.capsules", f"The arm has no link {unknown[0]!r} from base to tip."
            )
        return cls(chain, upright, given, description.meshes or {}, checkpoint)

    def rows(self, k: int) -> Rows:
        """Capsules of all URDF links fixed to link k, 0 for the base. Raises InvalidArm."""
        given = [row for link in self.chain.rigid[k] for row in self._given(k, link)]
        of_urdf = [
            row
            for link in self.chain.rigid[k]
            if link not in self.capsules
            for row in self._of_urdf(k, link)
        ]
        return given + of_urdf

    def hull(self, k: int) -> Rows | None:
        """Points of the hull around the mesh of link k, after `rows`; None unless one mesh is the
        only shape of the link, or if the hull would need more than MOST_POINTS.
        """
        links = [link for link in self.chain.rigid[k] if link in self.capsules or self._of(link)]
        if len(links) != 1 or links[0] in self.capsules or len(shapes := self._of(links[0])) != 1:
            return None
        mesh = shapes[0].find("geometry/mesh")
        key = ("", None) if mesh is None else (mesh.get("filename", ""), mesh.get("scale"))
        if key not in self._outermost:
            return None
        self.checkpoint()
        T = self._frame(k, links[0]) * _origin(shapes[0].find("origin"), "A <collision> has")
        try:
            points = hull_around(
                self._outermost[key] @ T.rotation.T + T.translation, MOST_POINTS, self.checkpoint
            )
        except QhullError:
            return None
        return points.tolist() if len(points) <= MOST_POINTS else None

    def _of(self, link: str) -> list[Element]:
        """The collision shapes of a URDF link."""
        element = next(each for each in self.chain.root.findall("link") if each.get("name") == link)
        return element.findall("collision")

    def _given(self, k: int, link: str) -> Rows:
        """The user's capsules of a URDF link."""
        rows = self.capsules.get(link, ())
        for row in rows:
            self._count("collision.capsules", link)
            with _of_field("collision.capsules"):
                check_lengths(f"The radius of a capsule of {link!r}", row[6], PLAUSIBLE.radius)
        return [
            _placed(self._frame(k, link), (np.array(row[:6]).reshape(2, 3), row[6])) for row in rows
        ]

    def _of_urdf(self, k: int, link: str) -> Rows:
        """A capsule around each collision shape of a URDF link."""
        frame, rows = self._frame(k, link), list[list[float]]()
        for shape in self._of(link):
            self._count("urdf", link)
            where = f"A <collision> of link {link!r} has"
            geometry = shape.find("geometry")
            around = None if geometry is None else self._around(geometry, where)
            if around is not None:
                rows.append(_placed(frame * _origin(shape.find("origin"), where), around))
        return rows

    def _around(self, geometry: Element, where: str) -> Around | None:
        """The capsule around a shape, in its frame; None for an unknown or missing shape."""
        if (mesh := geometry.find("mesh")) is not None:
            return self._around_mesh(mesh, f"{where} a <mesh>")
        for kind, parts in SOLIDS.items():
            element = geometry.find(kind)
            if element is None:
                continue
            what = f"{where} a <{kind}>"
            given = {part: numbers(element, part, what, count=n) for part, n in parts.items()}
            if not np.concatenate([*given.values()]).any():
                # a placeholder: the link has other shapes, or the capsule from joint to joint
                self.unknown.append(f"{kind} of no size")
                return None
            for part, lengths in given.items():
                with _of_field("urdf"):
                    check_lengths(f"{what}, whose `{part}`", lengths)
            if kind == "box":
                sides = given["size"] / 2
                longest = int(np.argmax(sides))
                axis = np.eye(3)[longest] * sides[longest]
                return np.array([-axis, axis]), float(np.linalg.norm(np.delete(sides, longest)))
            half = given.get("length", np.zeros(1)) / 2
            axis = np.array([0.0, 0.0, half[0]])
            return np.array([-axis, axis]), float(given["radius"][0])
        self.unknown.extend([each.tag for each in geometry][:1])
        return None

    def _around_mesh(self, mesh: Element, where: str) -> Around | None:
        name, scaled = mesh.get("filename", ""), mesh.get("scale")
        if (name, scaled) not in self._made:
            points = corners(self.meshes, name, self.checkpoint)
            if points is None:
                self.missing.append(name)
                return None
            scale = numbers(mesh, "scale", where, "1 1 1")
            points = self._outermost[name, scaled] = self._scaled(points, scale, where)
            self._made[name, scaled] = capsule_around(points, self.checkpoint)
        return self._made[name, scaled]

    def _scaled(self, points: Array, scale: Array, where: str) -> Array:
        """The outermost corners (n, 3) [m] of a mesh, given in units of `scale` (3,) [m]."""
        with _of_field("urdf"):
            check_scale(f"{where} with a `scale` that", scale, points)
        points = points * scale
        if not np.ptp(points, axis=0).max() < PLAUSIBLE.mesh:
            raise InvalidArm(
                "meshes", f"{where} larger than {PLAUSIBLE.mesh:g} m: has the URDF its `scale`?"
            )
        with _of_field("meshes"):
            check_surface(f"{where} that", points)
        return outermost(points, self.checkpoint)

    def _count(self, field: str, link: str) -> None:
        """Counts a shape of a link. Raises InvalidArm for too many."""
        self.checkpoint()
        self._seen.append(link)
        if len(self._seen) > LIMITS.shapes:
            raise InvalidArm(
                field,
                f"With link {link!r}, the arm has more than {LIMITS.shapes} shapes: give "
                "`collision.capsules`, fewer of them, for the links with the most shapes.",
            )

    def _frame(self, k: int, link: str) -> pin.SE3:
        """The pose of a URDF link in the frame of the moving link k."""
        model = self.chain.model
        placement = model.frames[model.getFrameId(link, pin.FrameType.BODY)].placement
        own = pin.SE3(self.chain.T_base) if k == 0 else pin.SE3(self.upright.R[k], np.zeros(3))
        return own.inverse() * placement


def check_near(name: str, rows: Rows) -> None:
    """Raises InvalidArm for capsules far from their joint or with undefined coordinates."""
    if not (np.abs(np.array(rows)) < PLAUSIBLE.length).all():
        raise InvalidArm(
            "urdf",
            f"The shape of link {name!r} is farther than {PLAUSIBLE.length:g} m from its joint.",
        )


@contextmanager
def _of_field(field: str) -> Iterator[None]:
    """Converts WrongSize into InvalidArm of a field."""
    try:
        yield
    except WrongSize as error:
        raise InvalidArm(field, str(error)) from None


def _placed(T: pin.SE3, around: Around) -> list[float]:
    axis, radius = around
    return [*(axis @ T.rotation.T + T.translation).ravel().tolist(), float(radius)]


def _origin(element: Element | None, where: str) -> pin.SE3:
    xyz, rpy = (numbers(element, part, f"{where} an <origin>", ZERO) for part in ("xyz", "rpy"))
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
