"""Fit hulls to the Franka Hand: `python -m joulepath.models.fit_tool_hulls MESHES` prints rows for
the figure `hulls` of tools/franka_hand.yaml.

MESHES is meshes/robot_ee/franka_hand_white in github.com/frankaemika/franka_description. The hulls
hold the hand, and each finger at every opening.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from joulepath.models.hull_cover import hull_around
from joulepath.models.meshes import KINDS, surface
from joulepath.models.robot import Array

HAND = "franka_hand"
"""Name of the tool."""
MOUNTED = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, -np.pi / 4), np.zeros(3))
"""Pose of the hand in the flange frame of Franka's arms."""
FINGERS = 0.0584
"""Height of the fingers' frames above that of the hand [m]."""
OPENINGS = np.linspace(0.0, 0.04, 21)
"""Travels of a finger [m], closed to open."""


def surfaces(folder: Path) -> Iterator[Array]:
    """Triangles (t, 3, 3) [m] in the flange frame of the hand, of both of KINDS, and of each finger
    at OPENINGS; the convex hull of the first and the last holds the finger in between.
    """
    hand = [surface(folder / kind / "hand") for kind in KINDS]
    yield _placed(np.concatenate(hand), MOUNTED)
    finger = surface(folder / "visual" / "finger")
    at_all = np.concatenate([finger + np.array([0.0, travel, 0.0]) for travel in OPENINGS])
    for turn in (0.0, np.pi):
        at = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, turn), np.array([0.0, 0.0, FINGERS]))
        yield _placed(at_all, MOUNTED * at)


def _placed(triangles: Array, T: pin.SE3) -> Array:
    return np.asarray(triangles @ T.rotation.T + T.translation)


def main() -> None:
    """Print the rows."""
    for triangles in surfaces(Path(sys.argv[1])):
        points = hull_around(triangles.reshape(-1, 3))
        rows = [f"[{', '.join(f'{x:.4f}' for x in point)}]" for point in points]
        lines = [", ".join(rows[k : k + 4]) for k in range(0, len(rows), 4)]
        print("    - [" + ",\n       ".join(lines) + "]")


if __name__ == "__main__":
    main()
