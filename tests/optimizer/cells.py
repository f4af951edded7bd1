"""Arms in a cell, for tests of collisions: every shape around the arm, a tool, and a load of any
shape.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath import (
    Arm,
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Payload,
    Scene,
    Sphere,
    Spline,
    capsule_between,
)
from joulepath.models.robot import Array
from joulepath.optimizer.problem.scene import Shape
from tests.optimizer.moves import ROBOT

LOADS: tuple[Shape, ...] = (
    Box(np.array([0.1, 0.15, 0.2])),
    Cylinder(0.05, 0.2),
    Sphere(0.08),
    Mesh(np.random.default_rng(11).normal(size=(12, 3)) * 0.05),
)


def at(position: object, rotvec: object = (0.0, 0.0, 0.0)) -> Array:
    T = np.eye(4)
    T[:3, :3] = pin.exp3(np.array(rotvec, dtype=float))
    T[:3, 3] = position
    return T


def cell(seed: int = 1) -> Scene:
    rng = np.random.default_rng(seed)
    shapes: list[Shape] = [
        Sphere(0.1),
        Box(np.array([0.3, 0.2, 0.4])),
        Cylinder(0.1, 0.4),
        Capsule(0.1, 0.4),
        Mesh(rng.normal(size=(30, 3)) * 0.1),
    ]
    around = [
        Obstacle(f"thing {k}", s, at(rng.uniform(-0.9, 0.9, 3), rng.normal(size=3)))
        for k, s in enumerate(shapes)
    ]
    near = Obstacle(
        "kept away from", Box(np.array([0.2, 0.2, 0.2])), at(rng.uniform(-0.9, 0.9, 3)), margin=0.03
    )
    return Scene([Obstacle("floor", HalfSpace(), at([0, 0, -0.4])), *around, near])


def arm_in_cell(load: Shape = LOADS[0], scene: Scene | None = None) -> Arm:
    fork = capsule_between(np.array([0, 0.05, 0.1]), np.array([0, -0.05, 0.1]), 0.02)
    return Arm(
        robot=ROBOT,
        tool=[capsule_between(np.array([0, 0, 0.03]), np.array([0, 0, 0.1]), 0.03), fork],
        payload=Payload(1.0, shape=Attachment(load, at([0, 0, 0.25], [0.1, 0.2, 0.3]))),
        scene=cell() if scene is None else scene,
    )


def wander(seed: int, duration: float = 1.5, spread: float = 0.3, points: int = 12) -> Spline:
    """A motion at rest at both ends, with random control points in between."""
    rng = np.random.default_rng(seed)
    q_start, q_goal = rng.uniform(-2, 2, (2, 6))
    fraction = np.linspace(0, 1, points - 4)[1:-1, None]
    inner = q_start + (q_goal - q_start) * fraction + rng.normal(size=(len(fraction), 6)) * spread
    control = np.array([q_start] * 3 + list(inner) + [q_goal] * 3)
    knots = np.concatenate([np.zeros(5), np.linspace(0, 1, len(control) - 4), np.ones(5)])
    return Spline(5, knots * duration, control)


def positions(spline: Spline, t: Array) -> Array:
    return np.asarray(spline.curve(t))
