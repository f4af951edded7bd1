"""Fit hulls to a tool: `python -m joulepath.models.fit_tool_hulls TOOL MESHES` prints rows for the
figure `hulls` of the tool, which has a `hull_radius` already.

MESHES is a folder as in `joulepath.models.tool_meshes`. The hulls hold the parts of the tool at
every opening.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from joulepath.models.hull_cover import hull_around
from joulepath.models.hull_parts import divided, nowhere
from joulepath.models.robot import Array
from joulepath.models.tool_meshes import TOOL_MESHES
from joulepath.models.tools.registry import tool_figures


def fitted_hulls(name: str, folder: Path) -> Iterator[Array]:
    """Points (n, 3) [m] of each hull in the flange frame, to be grown by the `hull_radius`.

    A convex body that holds a corner at two openings, grown by the sagitta, holds its way from one
    to the other: the hulls are fitted with a radius that is less by that.
    """
    meshes, radius = TOOL_MESHES[name], float(tool_figures(name)["hull_radius"]["value"])
    reach = radius - meshes.sagitta(folder)
    for part in meshes.parts:
        swept = [each.reshape(-1, 3, 3) for each in meshes.swept(folder, part)]
        for triangles in divided(swept, radius, nowhere, part.most):
            yield hull_around(triangles.reshape(-1, 3), radius=reach)


def main() -> None:
    """Print the rows."""
    for points in fitted_hulls(sys.argv[1], Path(sys.argv[2])):
        rows = [f"[{', '.join(f'{x:.4f}' for x in point)}]" for point in points]
        lines = [", ".join(rows[k : k + 4]) for k in range(0, len(rows), 4)]
        print("    - [" + ",\n       ".join(lines) + "]", flush=True)


if __name__ == "__main__":
    main()
