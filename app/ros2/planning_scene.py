"""Obstacles of `POST /optimize` from messages of MoveIt's planning scene.

The module reads the fields of the messages by name and needs no installation of ROS.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import numpy as np

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.ros2.messages import Json, refusal

ADD, REMOVE, APPEND, MOVE = range(4)
"""Operations of moveit_msgs/msg/CollisionObject."""
SOLIDS: dict[int, str] = {1: "box", 2: "sphere", 3: "cylinder"}
"""Shapes by the types of shape_msgs/msg/SolidPrimitive; cones and prisms are refused."""


@dataclass(frozen=True)
class _Object:
    """A collision object: its pose in the base frame, and its shapes with poses within it."""

    pose: Any
    shapes: tuple[tuple[Json, Any], ...]


class PlanningScene:
    """The collision objects of a planning scene, kept up to date by its messages."""

    def __init__(self, base_frames: Sequence[str], topic: str = "planning_scene") -> None:
        """Begin without objects.

        Args:
            base_frames: admissible frames of objects, all at the robot's base.
            topic: topic of the messages, for errors.
        """
        self._frames, self._topic = frozenset(base_frames), topic
        self._objects: dict[str, _Object] = {}
        self._problem: InvalidRequest | None = None

    def update(self, message: Any) -> None:
        """Take over a moveit_msgs/msg/PlanningScene, whole or a difference.

        Raises:
            InvalidRequest: the scene has an unsupported part: an octomap, an attached body, a
                shape besides box, sphere, cylinder and mesh, or an unknown frame. Planning is then
                refused until a whole scene arrives.
        """
        try:
            self._take_over(message)
        except InvalidRequest as error:
            self._problem = error
            raise
        if not message.is_diff:
            self._problem = None

    def _take_over(self, message: Any) -> None:
        if message.world.octomap.octomap.data:
            raise self._refused(
                "world.octomap", "Octomaps are not supported as obstacles: send objects."
            )
        if message.robot_state.attached_collision_objects:
            raise self._refused(
                "robot_state.attached_collision_objects",
                "Attached bodies are not read: give `tool` and `payload` in the parameter "
                "`request_file`.",
            )
        objects = dict(self._objects) if message.is_diff else {}
        for each in message.world.collision_objects:
            self._apply(objects, each)
        self._objects = objects

    def added_to(self, scene: Json | None) -> Json:
        """Add the objects to the obstacles of a `scene` of `POST /optimize`.

        Args:
            scene: the scene; None is an empty scene.

        Returns:
            The scene with all obstacles.

        Raises:
            InvalidRequest: the scene is in another frame than `base_link`, or the last message
                could not be taken over.
        """
        if self._problem is not None:
            raise self._problem
        given = scene or {}
        if not self._objects:
            return given
        if given.get("obstacles") and given.get("frame", "base") != "base_link":
            raise refusal(
                ("request_file", "scene", "frame"),
                "Obstacles of messages are in the frame base_link: give those of the file in it.",
            )
        found = [
            {"name": name if k == 0 else f"{name}.{k}", **shape, "pose": _pose(one.pose, pose)}
            for name, one in self._objects.items()
            for k, (shape, pose) in enumerate(one.shapes)
        ]
        return {**given, "frame": "base_link", "obstacles": [*given.get("obstacles", ()), *found]}

    def _apply(self, objects: dict[str, _Object], message: Any) -> None:
        operation = message.operation[0] if message.operation else ADD
        if operation == REMOVE:
            for name in [message.id] if message.id else list(objects):
                objects.pop(name, None)
            return
        if message.header.frame_id not in self._frames:
            raise self._refused(
                f"world.collision_objects.{message.id}.header.frame_id",
                f"The frame {message.header.frame_id!r} is not a frame of the robot's base: send "
                f"objects in one of {', '.join(sorted(filter(None, self._frames)))}.",
            )
        known = objects.get(message.id)
        if operation == MOVE:
            if known is None:
                raise self._refused(
                    "world.collision_objects", f"There is no object {message.id!r} to move."
                )
            objects[message.id] = _Object(message.pose, known.shapes)
            return
        shapes = self._shapes(message)
        if operation == APPEND and known is not None:
            shapes = (*known.shapes, *shapes)
        objects[message.id] = _Object(message.pose, shapes)

    def _shapes(self, message: Any) -> tuple[tuple[Json, Any], ...]:
        if message.planes:
            raise self._refused(
                f"world.collision_objects.{message.id}.planes",
                "Planes are not read: give a half space in the parameter `request_file`.",
            )
        shapes: list[tuple[Json, Any]] = []
        for read, found, poses in (
            (self._solid, message.primitives, message.primitive_poses),
            (self._mesh, message.meshes, message.mesh_poses),
        ):
            if len(poses) > len(found):
                raise self._refused(
                    f"world.collision_objects.{message.id}",
                    f"There are {len(poses)} poses for {len(found)} shapes: give one for each.",
                )
            # a shape without a pose takes the pose of its object
            shapes += zip_longest((read(message.id, each) for each in found), poses)
        return tuple(shapes)

    def _solid(self, name: str, solid: Any) -> Json:
        shape, sizes = SOLIDS.get(solid.type), list(solid.dimensions)
        if shape == "box" and len(sizes) == 3:
            return {"shape": shape, "size": sizes}
        if shape == "sphere" and len(sizes) == 1:
            return {"shape": shape, "radius": sizes[0]}
        if shape == "cylinder" and len(sizes) == 2:
            return {"shape": shape, "length": sizes[0], "radius": sizes[1]}
        raise self._refused(
            f"world.collision_objects.{name}.primitives",
            f"A primitive of type {solid.type} with {len(sizes)} dimensions is not supported: "
            "send a box, sphere, cylinder or mesh.",
        )

    def _mesh(self, name: str, mesh: Any) -> Json:
        """A mesh as a binary STL file."""
        points = np.array([[p.x, p.y, p.z] for p in mesh.vertices])
        triangles = np.array([each.vertex_indices for each in mesh.triangles], dtype=int)
        if not triangles.size or triangles.max() >= len(points):
            raise self._refused(
                f"world.collision_objects.{name}.meshes",
                f"A mesh has {len(triangles)} triangles between {len(points)} vertices, some of "
                "which do not exist: number its vertices from 0.",
            )
        corners = points[triangles].astype("<f4")
        # per triangle: normal (ignored by readers), corners, attribute
        faces = b"".join(bytes(12) + each.tobytes() + bytes(2) for each in corners)
        content = bytes(80) + struct.pack("<I", len(corners)) + faces
        return {"shape": "mesh_file", "format": "stl", "data": base64.b64encode(content).decode()}

    def _refused(self, field: str, message: str) -> InvalidRequest:
        return refusal((self._topic, *field.split(".")), message)


def _pose(outer: Any, inner: Any) -> Json:
    """Pose of a shape in the base frame.

    Args:
        outer: pose of the object in the base frame.
        inner: pose of the shape in the object.
    """
    p, q = _numbers(inner)
    o, r = _numbers(outer)
    return {
        "position": (o + _times(_times(r, np.append(p, 0.0)), _conjugate(r))[:3]).tolist(),
        "quaternion": _times(r, q).tolist(),
    }


def _numbers(pose: Any) -> tuple[Any, Any]:
    """Position and unit quaternion (x, y, z, w) of a pose; None is no displacement."""
    if pose is None:
        return np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    p, q = pose.position, pose.orientation
    quaternion = np.array([q.x, q.y, q.z, q.w])
    size = np.linalg.norm(quaternion)
    return np.array([p.x, p.y, p.z]), quaternion / size if size else quaternion


def _times(first: Any, second: Any) -> Any:
    """Product of two quaternions (x, y, z, w)."""
    a, b = first[:3], second[:3]
    vector = first[3] * b + second[3] * a + np.cross(a, b)
    return np.append(vector, first[3] * second[3] - a @ b)


def _conjugate(quaternion: Any) -> Any:
    return np.append(-quaternion[:3], quaternion[3])
