"""Bodies of hostile requests."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
NEAR_HOME = [0.3, -1.4, 1.4, -1.5, -1.57, 0.2]


def move() -> dict[str, Any]:
    """A short motion, as honest clients request it."""
    return {"start": {"q": HOME}, "goal": {"q": NEAR_HOME}}


def sampled(period: float) -> dict[str, Any]:
    """A motion of nearly 10 s with samples at a period [s]."""
    return move() | {
        "duration": 9.9,
        "sample_period": period,
        "method": "time_scaling",
        "deadline": 60,
    }


def long_search(deadline: float) -> dict[str, Any]:
    """A search over thousands of candidates, which lasts until its deadline [s]."""
    start, goal = (
        {"pose": {"position": position, "quaternion": [0.0, 1.0, 0.0, 0.0]}}
        for position in ([0.4, 0.2, 0.35], [0.3, -0.4, 0.2])
    )
    return {
        "start": start,
        "goal": goal,
        "objective": "mechanical",
        "duration": {"max": 5.0},
        "deadline": deadline,
    }


def numbers(size: int) -> bytes:
    """A body of about `size` bytes: a list of short lists."""
    return b'{"start": [' + b"[1,2]," * (size // 6 - 4) + b"[]]}"


def _stl(triangles: Any) -> bytes:
    """A binary STL file of triangles (n, 3, 3) [m]."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(len(triangles), record)
    records["corners"] = triangles
    return bytes(80) + len(triangles).to_bytes(4, "little") + records.tobytes()


def meshes(count: int, seed: int) -> dict[str, Any]:
    """A request for inverse kinematics among `count` different mesh files of 1280 triangles."""
    import trimesh  # imported here because it is slow and only this attack needs it

    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)

    def obstacle(index: int) -> dict[str, Any]:
        triangles = ball.triangles * rng.uniform(0.8, 1.2, 3)
        position = [1.2 + 0.2 * (index % 8), 0.0, 0.2 * (index // 8)]
        return {
            "name": f"part {index}",
            "shape": "mesh_file",
            "format": "stl",
            "data": base64.b64encode(_stl(triangles)).decode(),
            "pose": {"position": position, "quaternion": [0, 0, 0, 1]},
        }

    pose = {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]}
    return {"pose": pose, "scene": {"obstacles": [obstacle(index) for index in range(count)]}}
