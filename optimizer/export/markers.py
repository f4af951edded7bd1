"""Shapes of the arm and its surroundings as the fields of visualization_msgs/msg/Marker."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.collision.cores import Core

Fields = dict[str, Any]
# constants of visualization_msgs/msg/Marker
CUBE = 1
SPHERE = 2
CYLINDER = 3
TRIANGLES = 11


@dataclass(frozen=True)
class MarkerSettings:
    """Look of the shapes."""

    ground: float = 4.0
    """Edge of the square that stands for a half-space [m]."""
    thickness: float = 0.01
    """Thickness of this square [m]."""
    arm: tuple[float, float, float, float] = (0.55, 0.65, 0.8, 0.6)
    """Red, green, blue and opacity of the arm, its tool and payload."""
    surroundings: tuple[float, float, float, float] = (0.7, 0.7, 0.7, 0.8)
    """Red, green, blue and opacity of obstacles."""


MARKERS = MarkerSettings()


def markers(bodies: list[Body], frames: list[str]) -> list[Fields]:
    """Markers of bodies; RViz moves a marker with the frame of its link.

    Args:
        bodies: bodies of the arm, its tool, its payload, and the surroundings.
        frames: names of the frames of the base and of all links.
    """
    found = list[Fields]()
    for body in bodies:
        colour = MARKERS.arm if body.link else MARKERS.surroundings
        for T, shape in _solids(body.core):
            found.append(
                shape
                | {
                    "header": {"frame_id": frames[body.link]},
                    "ns": body.name,
                    "id": len(found),
                    "frame_locked": True,
                    "pose": pose(body.T_link_core @ T),
                    "color": dict(zip("rgba", colour, strict=True)),
                }
            )
    return found


def pose(T: Array) -> Fields:
    """The fields of geometry_msgs/msg/Pose of a transform (4, 4)."""
    turn = pin.Quaternion(np.ascontiguousarray(T[:3, :3])).normalized().coeffs().tolist()
    return {"position": xyz(T[:3, 3]), "orientation": dict(zip("xyzw", turn, strict=True))}


def xyz(values: Any) -> Fields:
    """The fields of a point or vector (3,)."""
    return dict(zip("xyz", map(float, values), strict=True))


def _solids(core: Core) -> Iterator[tuple[Array, Fields]]:
    """Solids with the union of a core, and their poses (4, 4) in the frame of the core.

    The roundings of boxes and hulls are left out.
    """
    if core.is_half_space:
        low = _at(np.array([0.0, 0.0, -MARKERS.thickness / 2]))
        yield low, _sized(CUBE, (MARKERS.ground, MARKERS.ground, MARKERS.thickness))
    elif core.half_size is not None:
        yield np.eye(4), _sized(CUBE, 2 * core.half_size)
    elif len(core.points) <= 2:
        yield from _round(core)
    else:
        hull = ConvexHull(core.points)
        corners = core.points[hull.simplices.ravel()]
        yield np.eye(4), _sized(TRIANGLES, (1, 1, 1)) | {"points": list(map(xyz, corners))}


def _round(core: Core) -> Iterator[tuple[Array, Fields]]:
    """A sphere, a capsule or a cylinder."""
    ends, radius = core.points, core.radius or core.disc_radius
    if core.radius:
        for end in ends:
            yield _at(end), _sized(SPHERE, (2 * radius,) * 3)
    if len(ends) == 2 and (length := float(np.linalg.norm(ends[1] - ends[0]))) > 0:
        T = _at(ends.mean(axis=0))
        T[:3, :3] = _turned_to((ends[1] - ends[0]) / length)
        yield T, _sized(CYLINDER, (2 * radius, 2 * radius, length))


def _turned_to(axis: Array) -> Array:
    """A rotation (3, 3) from the z axis to a unit vector (3,)."""
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis)
    return np.asarray(turn.toRotationMatrix())


def _at(position: Array) -> Array:
    T = np.eye(4)
    T[:3, 3] = position
    return T


def _sized(kind: int, size: Any) -> Fields:
    return {"type": kind, "scale": xyz(size)}
