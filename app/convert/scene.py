"""From the schemas of shapes and scenes to the optimizer's."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from app.convert.pose import to_matrix
from app.schemas import scene as asked
from optimizer.exceptions import InvalidProblem
from optimizer.problem.scene import (
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Scene,
    Shape,
    Sphere,
    capsule_between,
)

Made = TypeVar("Made")


def to_scene(scene: asked.Scene) -> Scene:
    """The optimizer's scene. Raises InvalidProblem, with the field named."""
    obstacles = []
    for k, given in enumerate(scene.obstacles):
        shape = _named(f"scene.obstacles.{k}", partial(_shape, given))
        obstacles.append(Obstacle(given.name, shape, to_matrix(given.pose), given.margin))
    return Scene(obstacles)


def tool_parts(tool: asked.Tool) -> list[Attachment]:
    """A tool's capsules in the flange frame."""
    return [capsule_between(np.array(c.start), np.array(c.end), c.radius) for c in tool.capsules]


def carried(shape: asked.CarriedShape) -> Attachment:
    """A shape fixed to the flange. Raises InvalidProblem, with the field named."""
    return _named("payload.shape", lambda: Attachment(_shape(shape), to_matrix(shape.pose)))


def _shape(given: asked.CarriedShape | asked.Obstacle) -> Shape:
    if isinstance(given, asked.Box):
        return Box(np.array(given.size))
    if isinstance(given, asked.Sphere):
        return Sphere(given.radius)
    if isinstance(given, asked.Cylinder):
        return Cylinder(given.radius, given.length)
    if isinstance(given, asked.Capsule):
        return Capsule(given.radius, given.length)
    if isinstance(given, asked.Mesh):
        return Mesh(np.array(given.vertices))
    return HalfSpace()


def _named(field: str, make: Callable[[], Made]) -> Made:
    """What `make` makes; its errors name where in the request the shape stands."""
    try:
        return make()
    except InvalidProblem as error:
        raise InvalidProblem(f"{field}.{error.field}", str(error)) from None
