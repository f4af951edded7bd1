"""Fit hulls to a tool: `python -m joulepath.models.fit_tool_hulls TOOL MESHES`.

The command prints rows for the figure `hulls` of the tool. The tool already needs the figure
`hull_radius`. MESHES is a folder as in `joulepath.models.tool_meshes`. The hulls contain the parts
of the tool at every opening.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from joulepath.models.hull_cover import hull_around
from joulepath.models.robot import Array
from joulepath.models.tool_meshes import TOOL_MESHES
from joulepath.models.tools.registry import tool_figures


def fitted_hulls(name: str, folder: Path) -> Iterator[Array]:
    """Fit hulls to the parts of a tool at all sampled openings.

    A corner of a part moves on an arc between two sampled openings. The arc deviates from its chord
    by at most the sagitta, so a convex body around both ends, grown by the sagitta, contains the
    arc. The hulls are therefore fitted with the `hull_radius` less the sagitta.

    Args:
        name: name of the tool.
        folder: folder of the meshes.

    Yields:
        Points of a hull in the flange frame, shape (n, 3) [m], to be grown by the `hull_radius`.
    """
    meshes, radius = TOOL_MESHES[name], float(tool_figures(name)["hull_radius"]["value"])
    reach = radius - meshes.sagitta(folder)
    for part in meshes.parts:
        swept = [each.reshape(-1, 3, 3) for each in meshes.swept(folder, part)]
        for triangles in part.within(np.concatenate(swept)):
            yield hull_around(triangles.reshape(-1, 3), radius=reach)


def main() -> None:
    """Print the rows."""
    for points in fitted_hulls(sys.argv[1], Path(sys.argv[2])):
        rows = [f"[{', '.join(f'{x:.4f}' for x in point)}]" for point in points]
        lines = [", ".join(rows[k : k + 4]) for k in range(0, len(rows), 4)]
        print("    - [" + ",\n       ".join(lines) + "]", flush=True)


if __name__ == "__main__":
    main()
