"""Cells of placement tests: short cycles of a UR5e in the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from joulepath import Arm, Box, Cycle, HalfSpace, Obstacle, Payload, Pose, Scene, Stop, load_robot
from joulepath.models.robot import Array

DOWN = [0.0, 1.0, 0.0, 0.0]
PART = Payload(mass=2.0, com=np.array([0.0, 0.0, 0.06]))


def down(x: float, y: float, z: float) -> Pose:
    """A pose with the tool down."""
    return Pose.from_quaternion([x, y, z], DOWN)


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, R: Array | None = None) -> Array:
    """A homogeneous matrix (4, 4)."""
    T = np.eye(4)
    T[:3, 3] = x, y, z
    T[:3, :3] = np.eye(3) if R is None else R
    return T


def floor(z: float = -0.5) -> Obstacle:
    """A floor."""
    return Obstacle("floor", HalfSpace(), at(z=z))


def wall(x: float) -> Obstacle:
    """A thick wall of 1 m in front of the robot."""
    return Obstacle("wall", Box(np.array([0.2, 1.0, 2.0])), at(x=x))


def arm(obstacles: Sequence[Obstacle] = (), **fields: Any) -> Arm:
    """A UR5e among obstacles."""
    return Arm(robot=load_robot("ur5e"), scene=Scene(obstacles), **fields)


def two_stops(obstacles: Sequence[Obstacle] = (), **fields: Any) -> Cycle:
    """A cycle from a pick to a place and back, with a part of 2 kg on the way to the place."""
    stops = [
        Stop(name="pick", target=down(0.5, -0.3, 0.2), payload=PART, dwell=0.2),
        Stop(name="place", target=down(0.5, 0.3, 0.2), payload=Payload()),
    ]
    given: dict[str, Any] = {"arm": arm(obstacles), "start": down(0.45, 0.0, 0.35), "stops": stops}
    return Cycle(**given | {"windings": False} | fields)
