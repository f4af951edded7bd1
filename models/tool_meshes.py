"""Triangles of the meshes of tools in the flange frame, at every opening.

The meshes are not part of this package. A folder contains the meshes in the layout of their source
repository. A turning piece moves along arcs between two openings; `sagitta` bounds the distance of
an arc from its chord.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from joulepath.models.hull_parts import below
from joulepath.models.meshes import KINDS, in_package, surface
from joulepath.models.robot import Array, Mask

Vector = tuple[float, float, float]
MILLIMETRES = 1e-3
"""Unit of some of the files [m]."""
FARTHEST: tuple[Vector, Vector] = (-np.inf, -np.inf, -np.inf), (np.inf, np.inf, np.inf)
"""The cell that is the whole space."""
FLANGE_RADIUS = 0.0315
"""Radius of the flange to which the tools are bolted, ISO 9409-1-50-4-M6 [m]."""


@dataclass(frozen=True, eq=False)
class Joint:
    """Joint of a tool: its frame in the frame of the joint before, and its motion per travel: an
    angle about x [rad] or a way along y [m].
    """

    origin: pin.SE3
    turn: float = 0.0
    slide: float = 0.0

    def pose(self, travel: float) -> pin.SE3:
        """Pose of the moved piece in the frame of the joint before."""
        turned = pin.rpy.rpyToMatrix(self.turn * travel, 0.0, 0.0)
        return self.origin * pin.SE3(turned, np.array([0.0, self.slide * travel, 0.0]))


@dataclass(frozen=True, eq=False)
class Piece:
    """Rigid piece of a tool: files below the folder, without suffix, or a box of three edges [m]
    around the origin, in the frame of the last of its joints. The unit of the files is `scale` [m].
    """

    joints: tuple[Joint, ...]
    files: tuple[str, ...] = ()
    scale: float = 1.0
    box: Vector | None = None

    def triangles(self, folder: Path) -> Array:
        """Triangles (t, 3, 3) [m] in the frame of the last joint."""
        if self.box is not None:
            corners = np.array(list(product(*((-x / 2, x / 2) for x in self.box))))
            return np.asarray(corners[ConvexHull(corners).simplices])
        return self.scale * np.concatenate([surface(folder / file) for file in self.files])

    def at(self, triangles: Array, travel: float) -> Array:
        """Triangles of the last joint's frame in the flange frame at a travel."""
        T = pin.SE3.Identity()
        for joint in self.joints:
            T = T * joint.pose(travel)
        return np.asarray(triangles @ T.rotation.T + T.translation)

    def sagitta(self, triangles: Array, step: float) -> float:
        """The largest distance [m] of the arcs of the corners from their chords, for steps of the
        travel. All joints of a piece turn about parallel axes.

        A piece at angle w · travel to the flange adds w² times its reach to the second derivative
        of a corner's position by the travel. A chord of step h deviates from its arc by at most
        h² / 8 times this derivative.
        """
        reaches = [np.linalg.norm(joint.origin.translation[1:]) for joint in self.joints[1:]]
        reaches.append(np.linalg.norm(triangles[..., 1:], axis=-1).max())
        rates = np.cumsum([joint.turn for joint in self.joints])
        return float((rates**2 * reaches).sum() * step**2 / 8)


@dataclass(frozen=True, eq=False)
class Part:
    """Pieces of a tool with common hulls, one hull per cell.

    A cell is a box between two opposite corners in the flange frame [m]. Cells overlap, so the
    proof of the cover ends at triangles of the size of the overlap. Moving pieces have one cell,
    the whole space, because a triangle on its way between two cells would be in no hull.
    """

    pieces: tuple[Piece, ...]
    cells: tuple[tuple[Vector, Vector], ...] = (FARTHEST,)

    def within(self, triangles: Array) -> list[Array]:
        """The pieces (k, 3, 3) of triangles (t, 3, 3) [m] of the flange frame, by cell."""
        found = []
        for low, high in self.cells:
            inside = triangles
            for axis, begin, end in zip(np.eye(3), low, high, strict=True):
                inside = below(below(inside, axis, end), -axis, -begin)
            found.append(inside)
        return found


@dataclass(frozen=True, eq=False)
class ToolMeshes:
    """The parts of a tool, and `openings`: travels of its fingers, from one end to the other."""

    parts: tuple[Part, ...]
    openings: Array

    def sagitta(self, folder: Path) -> float:
        """The largest distance [m] of any piece between two openings from the chords."""
        step = float(np.diff(self.openings).max())
        pieces = [piece for part in self.parts for piece in part.pieces]
        return max(piece.sagitta(piece.triangles(folder), step) for piece in pieces)

    def swept(self, folder: Path, part: Part) -> list[Array]:
        """Triangles (n, t, 3, 3) [m] in the flange frame, by piece of a part, at n openings; n = 1
        for a fixed piece.
        """
        found = []
        for piece in part.pieces:
            triangles = piece.triangles(folder)
            moves = any(joint.turn or joint.slide for joint in piece.joints)
            openings = self.openings if moves else self.openings[:1]
            found.append(np.array([piece.at(triangles, travel) for travel in openings]))
        return found


def between(openings: Array) -> Array:
    """Moves of triangles (n, t, 3, 3) between consecutive openings.

    Returns:
        Triangles (k, 3, 6) with both places of every corner; the triangles (t, 3, 3) of a fixed
        piece.
    """
    if len(openings) == 1:
        return np.asarray(openings[0])
    return np.concatenate([openings[:-1], openings[1:]], axis=-1).reshape(-1, 3, 6)


def on_flange(points: Array) -> Mask:
    """Whether points (k, 3) [m] of the flange frame are in the flange of the arm, out of reach of
    obstacles.
    """
    return np.asarray((points[:, 2] < 0) & (np.hypot(points[:, 0], points[:, 1]) < FLANGE_RADIUS))


def _placed(*xyz_yaw: float) -> pin.SE3:
    """A pose from x, y, z [m] and the angle about z [rad]; missing values are zero."""
    x, y, z, yaw = (*xyz_yaw, 0.0, 0.0, 0.0, 0.0)[:4]
    return pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, yaw), np.array([x, y, z]))


def _franka_hand() -> ToolMeshes:
    """Meshes: meshes/robot_ee/franka_hand_white in github.com/frankaemika/franka_description.

    The hand is turned by -45° about z, as on Franka's arms.
    """
    hand = Joint(_placed(0.0, 0.0, 0.0, -np.pi / 4))
    fingers = [Joint(_placed(0.0, 0.0, 0.0584, yaw), slide=1.0) for yaw in (0.0, np.pi)]
    return ToolMeshes(
        (
            Part((Piece((hand,), tuple(f"{kind}/hand" for kind in KINDS)),)),
            *(Part((Piece((hand, finger), ("visual/finger",)),)) for finger in fingers),
        ),
        np.linspace(0.0, 0.04, 21),
    )


def _robotiq_2f_85() -> ToolMeshes:
    """Meshes and joints: airo_models/grippers/robotiq_2f_85 of the package `airo-models`.

    Coupling and base are at the heights of robotiq_2f85/2f85.xml in
    github.com/google-deepmind/mujoco_menagerie, the source of the TCP. The travel is the angle of
    the outer knuckles. It ends when the pads touch, at the greater one of the limits of both
    sources.
    """
    base = Joint(_placed(0.0, 0.0, 0.0108))

    def both(file: str) -> tuple[str, ...]:
        return tuple(f"{kind}/robotiq_arg2f_85_{file}" for kind in KINDS)

    knuckles, outer, inner, pads = list[Piece](), list[Piece](), list[Piece](), list[Piece]()
    for yaw in (0.0, np.pi):
        side = Joint(_placed(0.0, 0.0, 0.0, yaw))
        knuckle = base, side, Joint(_placed(0.0, 0.0306011, 0.054904), turn=1.0)
        finger = *knuckle, Joint(_placed(0.0, 0.0315, -0.0041))
        tip = *finger, Joint(_placed(0.0, 0.0061, 0.0471), turn=-1.0)
        link = base, side, Joint(_placed(0.0, 0.0127, 0.06142), turn=1.0)
        knuckles += [
            Piece(knuckle, both("outer_knuckle"), MILLIMETRES),
            Piece(tip, both("inner_finger"), MILLIMETRES),
        ]
        outer.append(Piece(finger, both("outer_finger"), MILLIMETRES))
        inner.append(Piece(link, both("inner_knuckle"), MILLIMETRES))
        pads += [
            Piece(tip, ("visual/robotiq_arg2f_85_pad",), MILLIMETRES),
            Piece((*tip, Joint(_placed(0.0, -0.0220203, 0.03242))), box=(0.022, 0.00635, 0.0375)),
        ]
    coupling = Joint(_placed(0.0, 0.0, 0.007, np.pi / 2))
    housing = (
        Piece((coupling,), ("visual/robotiq_gripper_coupling",), MILLIMETRES),
        Piece((base,), both("base_link")),
    )
    return ToolMeshes(
        (
            Part(housing),
            *(Part((piece,)) for piece in outer),
            *(Part(tuple(pieces)) for pieces in (inner, knuckles, pads)),
        ),
        np.linspace(0.0, 0.81, 15),
    )


def _onrobot_rg2() -> ToolMeshes:
    """Meshes and joints: onrobot_rg_description/meshes/rg2 and urdf in
    github.com/ABC-iRobotics/onrobot-ros2.

    The joints are 2.457 mm higher than in onrobot_rg2/urdf/onrobot_rg2_macro.xacro of the maker's
    github.com/OnRobot/onrobot-ros2, the source of the TCP, and the fingers move along y. The
    housing's mesh for collision checks is left out, because it is only the convex hull.
    """
    mount = Joint(_placed(0.0, 0.0, -0.002457, np.pi / 2))

    def piece(file: str, *joints: Joint) -> Piece:
        return Piece((mount, *joints), tuple(f"{kind}/{file}" for kind in KINDS))

    outer, inner = list[Piece](), list[Piece]()
    for yaw in (0.0, np.pi):
        side = Joint(_placed(0.0, 0.0, 0.0, yaw))
        knuckle = side, Joint(_placed(0.0, -0.017178, 0.125797), turn=-1.0)
        link = side, Joint(_placed(0.0, -0.007678, 0.142297), turn=-1.0)
        tip = *knuckle, Joint(_placed(0.0, -0.039592, 0.038177), turn=1.0)
        outer += [piece("outer_knuckle", *knuckle), piece("inner_finger", *tip)]
        inner.append(piece("inner_knuckle", *link))
    housing = Piece((mount,), ("visual/base_link",))
    # foot, ring, column, its widening at the joints, and a rib on either side of the column
    inf, over = np.inf, 1e-4
    cells = (
        ((-inf, -inf, -inf), (inf, inf, 0.0155)),
        ((-inf, -inf, 0.0155 - over), (inf, inf, 0.0295)),
        ((-0.0273, -inf, 0.0295 - over), (0.0273, inf, 0.104)),
        ((-inf, -inf, 0.104 - over), (inf, inf, inf)),
        ((0.0273 - over, -inf, 0.0295 - over), (inf, inf, 0.07)),
        ((-inf, -inf, 0.0295 - over), (over - 0.0273, inf, 0.07)),
    )
    return ToolMeshes(
        (Part((housing,), cells), Part(tuple(outer)), *(Part((each,)) for each in inner)),
        np.linspace(-0.558505, 0.785398, 21),
    )


TOOL_MESHES = {
    "franka_hand": _franka_hand(),
    "onrobot_rg2": _onrobot_rg2(),
    "robotiq_2f_85": _robotiq_2f_85(),
}
"""Tools whose meshes are public, by name."""


def installed_tool(name: str) -> Path | None:
    """The folder of a tool's meshes in the package `airo-models`; None without the package."""
    return in_package("grippers", name, "meshes")
