"""Fit hulls to the links: `python -m joulepath.models.fit_hulls ROBOT MESHES [link …]` prints rows
for the section `hulls` of figures.yaml, which has the radius already.

MESHES is a folder as in `joulepath.models.meshes`. A bent link is divided into parts, with one hull
each. The points of a hull are vertices of the convex hull of its part, so that the hull reaches at
most its radius beyond that convex hull.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from joulepath.models.capsule_cover import turned_into
from joulepath.models.hull_cover import hull_around
from joulepath.models.hull_parts import Inside, Mask, divided
from joulepath.models.meshes import link_surfaces
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, LinkHull, Robot


def fitted_hulls(folder: Path, robot: Robot, link: int) -> list[LinkHull]:
    """The hulls around the parts of a link."""
    radius = robot.figures["hulls"]["radius"]["value"]
    surfaces = list(link_surfaces(folder, robot.name, link).values())
    parts = divided(surfaces, radius, _within_neighbours(folder, robot, link, radius))
    return [
        LinkHull(link, hull_around(part.reshape(-1, 3), radius=radius), radius) for part in parts
    ]


def _within_neighbours(folder: Path, robot: Robot, link: int, radius: float) -> Inside:
    """Whether points are within the hull of a neighbouring link at TURNS angles of the joint: in
    the hollow ends of links, where no obstacle can be.
    """
    planes = dict[int, Array]()
    for other in (link - 1, link + 1):
        if 1 <= other <= robot.nq:
            surfaces = link_surfaces(folder, robot.name, other).values()
            corners = np.concatenate([each.reshape(-1, 3) for each in surfaces])
            planes[other] = ConvexHull(hull_around(corners)).equations

    def inside(points: Array) -> Mask:
        found = np.zeros(len(points), dtype=bool)
        for other, hull in planes.items():
            is_inside = ~found
            for turned in turned_into(robot, link, other, points):
                height = turned[is_inside] @ hull[:, :3].T + hull[:, 3]
                is_inside[is_inside] = (height <= radius).all(axis=1)
            found |= is_inside
        return found

    return inside


def main() -> None:
    """Print the rows of the given links, or of all moving links."""
    robot, folder = load_robot(sys.argv[1]), Path(sys.argv[2])
    for name in sys.argv[3:] or robot.link_names[1:]:
        hulls = []
        for hull in fitted_hulls(folder, robot, robot.link_names.index(name)):
            rows = [f"[{', '.join(f'{x:.4f}' for x in point)}]" for point in hull.points]
            lines = [", ".join(rows[k : k + 4]) for k in range(0, len(rows), 4)]
            hulls.append("[\n      " + ",\n      ".join(lines) + "]")
        print(f"  {name}:\n    value: [{', '.join(hulls)}]", flush=True)


if __name__ == "__main__":
    main()
