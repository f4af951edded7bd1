"""Examples of POST /ik and POST /ik/path."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example
from joulepath.app.schemas.examples.values import TOOL, at

IK_EXAMPLES: dict[str, Example] = {
    "pose": {
        "summary": "A pose",
        "description": "All arm configurations that reach it, with full-turn alternatives.",
        "value": {"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
    },
    "table_and_post": {
        "summary": "Over a table, beside a post, with a tool and a part",
        "description": "`collides` and `nearest` in the answer tell which configurations are free of collisions.",
        "value": {
            "pose": {"position": [-0.45, -0.2, 0.25], "quaternion": [0, 1, 0, 0]},
            "tcp": at(0.0, 0.0, 0.15),
            "tool": TOOL,
            "windings": False,
            "payload": {"shape": {"shape": "box", "size": [0.08, 0.08, 0.06], "pose": at(0.0, 0.0, 0.17)}},
            "scene": {
                "obstacles": [
                    {"name": "floor", "shape": "half_space", "pose": at(0.0, 0.0, -0.01)},
                    {
                        "name": "table",
                        "shape": "box",
                        "size": [0.5, 0.8, 0.15],
                        "margin": 0.02,
                        "pose": at(-0.55, -0.1, 0.075),
                    },
                    {
                        "name": "post",
                        "shape": "cylinder",
                        "radius": 0.05,
                        "length": 1.2,
                        "pose": at(-0.3, 0.35, 0.6),
                    },
                ]
            },
        },
    },
}

ARC = [[0.45, -0.15, 0.35], [0.45, 0.0, 0.4], [0.45, 0.15, 0.35]]
"""Positions [m] of the TCP."""
_GUESS = [2.7, -1.4, 1.8, -2.0, -1.57, 0.0]

IK_PATH_EXAMPLES: dict[str, Example] = {
    "positions": {
        "summary": "Three positions on an arc, with a free orientation",
        "value": {"t": [0.0, 0.5, 1.0], "points": ARC, "guess": _GUESS},
    },
    "poses": {
        "summary": "The same positions with the tool pointing down",
        "value": {
            "t": [0.0, 0.5, 1.0],
            "poses": [{"position": point, "quaternion": [0.0, 1.0, 0.0, 0.0]} for point in ARC],
            "guess": _GUESS,
        },
    },
}
