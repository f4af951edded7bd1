"""Fit hulls to the links: `python -m joulepath.models.fit_hulls ROBOT MESHES [link …]`.

The command prints rows for the section `hulls` of figures.yaml; the section already needs the
radius. MESHES is a folder as in `joulepath.models.meshes`. A bent link is divided into parts, one
hull per part, and the rim of a hollow flange into sectors. A hollow filled by the hulls of a
neighbouring link at every angle of the joint is not divided; therefore the links of a new robot are
fitted twice. The points of a hull are vertices of the convex hull of its part, so the grown hull
exceeds this convex hull by at most its radius.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np

from joulepath.models.capsule_cover import within_neighbours
from joulepath.models.hull_cover import hull_around
from joulepath.models.hull_parts import Rim, divided
from joulepath.models.meshes import link_surfaces
from joulepath.models.registry import bundled_robot
from joulepath.models.robot import LinkHull, Robot

RIMS = {("gen3", "bracelet_link"): Rim(-0.0612, 6), ("iiwa14", "link_7"): Rim(0.0392, 4)}
"""Links with a hollow flange. More sectors reach less into the hollow: six, where the link is a
large part of the arm's surface."""


def fitted_hulls(folder: Path, robot: Robot, link: int) -> list[LinkHull]:
    """Fit hulls to the parts of a link."""
    radius = robot.figures["hulls"]["radius"]["value"]
    surfaces = list(link_surfaces(folder, robot.name, link).values())
    inside = partial(within_neighbours, robot, link, robot.hulls)
    rim = RIMS.get((robot.name, robot.link_names[link]))
    parts = rim.parts(np.concatenate(surfaces)) if rim else divided(surfaces, radius, inside)
    return [
        LinkHull(link, hull_around(part.reshape(-1, 3), radius=radius), radius) for part in parts
    ]


def main() -> None:
    """Print the rows of the given links, or of all moving links."""
    robot, folder = bundled_robot(sys.argv[1]), Path(sys.argv[2])
    for name in sys.argv[3:] or robot.link_names[1:]:
        hulls = []
        for hull in fitted_hulls(folder, robot, robot.link_names.index(name)):
            rows = [f"[{', '.join(f'{x:.4f}' for x in point)}]" for point in hull.points]
            lines = [", ".join(rows[k : k + 4]) for k in range(0, len(rows), 4)]
            hulls.append("[\n      " + ",\n      ".join(lines) + "]")
        print(f"  {name}:\n    value: [{', '.join(hulls)}]", flush=True)


if __name__ == "__main__":
    main()
