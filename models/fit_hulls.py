"""Fit hulls to the links: `python -m joulepath.models.fit_hulls ROBOT MESHES [link …]` prints rows
for the section `hulls` of figures.yaml.

MESHES is a folder as in `joulepath.models.meshes`. The points of a hull are vertices of the convex
hull of the link's meshes, so that the hull reaches at most its radius beyond that convex hull.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from joulepath.models.hull_cover import HULL_FIT, hull_around
from joulepath.models.meshes import link_surfaces
from joulepath.models.registry import load_robot
from joulepath.models.robot import LinkHull


def fitted_hull(folder: Path, robot: str, link: int) -> LinkHull:
    """The hull around all meshes of a link."""
    surfaces = link_surfaces(folder, robot, link).values()
    corners = np.concatenate([each.reshape(-1, 3) for each in surfaces])
    return LinkHull(link, hull_around(corners), HULL_FIT.radius)


def main() -> None:
    """Print the rows of the given links, or of all moving links."""
    robot, folder = load_robot(sys.argv[1]), Path(sys.argv[2])
    for name in sys.argv[3:] or robot.link_names[1:]:
        hull = fitted_hull(folder, robot.name, robot.link_names.index(name))
        rows = [f"[{', '.join(f'{x:.4f}' for x in point)}]" for point in hull.points]
        lines = [", ".join(rows[k : k + 4]) for k in range(0, len(rows), 4)]
        print(f"  {name}:\n    value: [\n      " + ",\n      ".join(lines) + "]", flush=True)


if __name__ == "__main__":
    main()
