"""Shapes of the links of a URDF, in the frames of the moving links.

A link has the user's capsules, or else one capsule around each of its `<collision>` shapes, and
hulls of these shapes. Meshes count if their files were given.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import product
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin
from scipy.spatial import QhullError

from joulepath.models.hull_cover import HULL_FIT, hull_around
from joulepath.models.hull_parts import QUICK, divided, nowhere
from joulepath.models.own_arm.capsule_around import capsule_around, outermost
from joulepath.models.own_arm.description import PLAUSIBLE, CapsuleRow, Description, InvalidArm
from joulepath.models.own_arm.mesh_files import surface
from joulepath.models.own_arm.robot_xml import ZERO, numbers
from joulepath.models.own_arm.upright import UprightChain
from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.robot import Array
from joulepath.models.shape_sizes import WrongSize, check_lengths, check_scale, check_surface
from joulepath.models.uploads.limits import LIMITS, Checkpoint


@dataclass(frozen=True)
class HullLimits:
    """Limits of the hulls of a link, beyond which it has capsules alone."""

    points: int = 128
    """Most points of a hull: with more, distances take longer than those of a few capsules."""
    count: int = 16
    """Most hulls of a link: a hand is drawn with some ten boxes, and every hull is compared with
    those of all other links."""
    triangles: int = 300_000
    """Most triangles of a mesh that is divided into parts: their corners take 20 MB."""
    sides: int = 24
    """Sides of the prism around a cylinder: it reaches 1 % of the radius beyond."""


HULLS = HullLimits()
NO_CORNERS = np.empty((0, 3))
NO_TRIANGLES = np.empty((0, 3, 3))
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


@dataclass(frozen=True, eq=False)
class _Solid:
    """A collision shape in its own frame: the capsule around it, corners (n, 3) [m] whose convex
    hull contains it, none if it is round, and the triangles (t, 3, 3) [m] of a mesh.
    """

    around: Around
    corners: Array
    triangles: Array = field(default_factory=lambda: NO_TRIANGLES)

    def parts(self, checkpoint: Checkpoint) -> list[Array]:
        """Corners (n, 3) [m] of the parts of a bent mesh, or those of the whole shape."""
        if not len(self.triangles):
            return [self.corners]
        try:
            parts = divided([self.triangles], HULL_FIT.radius, nowhere, QUICK, checkpoint)
        except (QhullError, ValueError):
            return [self.corners]  # flat
        return [part.reshape(-1, 3) for part in parts] if len(parts) > 1 else [self.corners]


_Placed = tuple[pin.SE3, _Solid]
"""Pose of a shape in the frame of its moving link, and the shape."""


@dataclass(frozen=True)
class Cover:
    """The shapes of a link in its frame."""

    capsules: Rows
    hulls: list[Rows]
    """Points of the hulls [m]. A link with hulls is compared by them instead of its capsules."""


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
    _made: dict[tuple[str, str | None], _Solid] = field(default_factory=dict)

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

    def cover(self, k: int, name: str) -> Cover:
        """The capsules and hulls of all URDF links fixed to link k, called `name`; 0 for the base.
        Raises InvalidArm.
        """
        links = self.chain.rigid[k]
        given = [row for link in links for row in self._given(k, link)]
        placed = [
            each for link in links if link not in self.capsules for each in self._of_urdf(k, link)
        ]
        rows = given + [_row(T, solid.around) for T, solid in placed]
        check_near(name, rows)
        is_given = any(link in self.capsules for link in links)
        return Cover(rows, [] if is_given else self._hulls(placed))

    def _hulls(self, placed: list[_Placed]) -> list[Rows]:
        """Points of the hulls of the shapes of a link. Empty with a round shape, of which its
        capsule is the closest hull, and if too many points would be needed.
        """
        found = list[Rows]()
        for T, solid in placed:
            parts = solid.parts(self.checkpoint) if len(placed) == 1 else [solid.corners]
            for part in parts:
                if not len(part):
                    return []  # round
                corners = part @ T.rotation.T + T.translation
                found.append(hull_around(corners, HULLS.points, self.checkpoint).tolist())
        fits = len(found) <= HULLS.count and all(len(each) <= HULLS.points for each in found)
        return found if fits else []

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
        T = self._frame(k, link)
        return [_row(T, (np.array(row[:6]).reshape(2, 3), row[6])) for row in rows]

    def _of_urdf(self, k: int, link: str) -> list[_Placed]:
        """The collision shapes of a URDF link."""
        frame, found = self._frame(k, link), list[_Placed]()
        for shape in self._of(link):
            self._count("urdf", link)
            where = f"A <collision> of link {link!r} has"
            geometry = shape.find("geometry")
            solid = None if geometry is None else self._solid(geometry, where)
            if solid is not None:
                found.append((frame * _origin(shape.find("origin"), where), solid))
        return found

    def _solid(self, geometry: Element, where: str) -> _Solid | None:
        """A shape in its frame; None for an unknown or missing shape."""
        if (mesh := geometry.find("mesh")) is not None:
            return self._of_mesh(mesh, f"{where} a <mesh>")
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
                around = np.array([-axis, axis]), float(np.linalg.norm(np.delete(sides, longest)))
                return _Solid(around, sides * list(product((-1, 1), repeat=3)))
            half, radius = given.get("length", np.zeros(1))[0] / 2, float(given["radius"][0])
            axis = np.array([0.0, 0.0, half])
            around = np.array([-axis, axis]), radius
            return _Solid(around, _prism(radius, half) if kind == "cylinder" else NO_CORNERS)
        self.unknown.extend([each.tag for each in geometry][:1])
        return None

    def _of_mesh(self, mesh: Element, where: str) -> _Solid | None:
        name, scaled = mesh.get("filename", ""), mesh.get("scale")
        if (name, scaled) not in self._made:
            read = surface(self.meshes, name, self.checkpoint)
            if read is None:
                self.missing.append(name)
                return None
            scale = numbers(mesh, "scale", where, "1 1 1")
            points = self._scaled(read[0], scale, where)
            corners = outermost(points, self.checkpoint)
            around = capsule_around(corners, self.checkpoint)
            is_small = len(read[1]) <= HULLS.triangles
            triangles = points[read[1]] if is_small else NO_TRIANGLES
            self._made[name, scaled] = _Solid(around, corners, triangles)
        return self._made[name, scaled]

    def _scaled(self, points: Array, scale: Array, where: str) -> Array:
        """The corners (n, 3) [m] of a mesh, given in units of `scale` (3,) [m]."""
        with _of_field("urdf"):
            check_scale(f"{where} with a `scale` that", scale, points)
        points = points * scale
        if not np.ptp(points, axis=0).max() < PLAUSIBLE.mesh:
            raise InvalidArm(
                "meshes",
                f"{where} larger than {PLAUSIBLE.mesh:g} m: does the URDF give its `scale`?",
            )
        with _of_field("meshes"):
            check_surface(f"{where} that", points)
        return points

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


def _prism(radius: float, half: float) -> Array:
    """Corners (n, 3) [m] of a prism around a cylinder about the z axis."""
    turn = 2 * np.pi * np.arange(HULLS.sides) / HULLS.sides
    reach = radius / np.cos(np.pi / HULLS.sides)
    x, y = reach * np.cos(turn), reach * np.sin(turn)
    return np.concatenate(
        [np.stack([x, y, np.full(HULLS.sides, z)], axis=1) for z in (-half, half)]
    )


def _row(T: pin.SE3, around: Around) -> list[float]:
    axis, radius = around
    return [*(axis @ T.rotation.T + T.translation).ravel().tolist(), float(radius)]


def _origin(element: Element | None, where: str) -> pin.SE3:
    xyz, rpy = (numbers(element, part, f"{where} an <origin>", ZERO) for part in ("xyz", "rpy"))
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
