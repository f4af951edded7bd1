"""Excess of the capsules and hulls of links and tools over the meshes that they cover.

    python -m benchmarks.covers
    python -m benchmarks.covers --meshes panda=FOLDER ur10e=FOLDER franka_hand=FOLDER

FOLDER contains the meshes of a robot (`joulepath.models.meshes`) or of a tool
(`joulepath.models.tool_meshes`). Without folders, the package `airo-models` provides the meshes of
UR3e, UR5e and Robotiq 2F-85. For every moving link, the table has the number of uncovered pieces of
the mesh triangles, and the excess: the distance of points on the surface of the cover from the
nearest point of any mesh of the link. Points within the covers of a neighbouring link, at eight
angles of the joint between the links, do not count; neither do points of a tool inside the flange.
The opening of 24 mm × 19 mm in the flange of Gen3 counts as closed by its lid in LIDS. A tool has
one set of meshes per opening; the cover is also proven between the openings. The exit code is 1 if
a hull leaves a piece uncovered or exceeds LARGEST_P99 or LARGEST_EXCESS.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from benchmarks.command import on_one_core, parser, write_json
from joulepath.models.capsule_cover import LinkCover, not_held, outside, within_neighbours
from joulepath.models.hull_parts import Inside, nowhere
from joulepath.models.meshes import MESH_FILES, SHIFTS, installed, link_surfaces, sampled
from joulepath.models.robot import Array, LinkCapsule, LinkHull
from joulepath.models.tool_meshes import TOOL_MESHES, between, installed_tool, on_flange
from joulepath.models.tools.registry import tool_figures
from joulepath.optimizer.problem.robots import load_robot

LARGEST_P99 = 3e-3
"""Limit on the 99th percentile of the excess of hulls over the surface of an arm or tool [m]."""
LARGEST_EXCESS = 8e-3
"""Limit on the maximum of this excess [m]."""
LIDS = {
    ("gen3", 7): np.array(
        [
            [[-0.012, 0.0163, -0.0607], [0.012, 0.0163, -0.0607], [0.012, 0.0355, -0.0607]],
            [[-0.012, 0.0163, -0.0607], [0.012, 0.0355, -0.0607], [-0.012, 0.0355, -0.0607]],
        ]
    )
}
"""Openings less than 20 mm wide that count as closed, by robot and link: triangles (t, 3, 3) [m].
No obstacle of practical size fits into them."""
DENSITY = 100_000
"""Sampled points per area of the surface of a cover [1/m²]."""
MESH_POINTS = 200_000
"""Sampled points of a mesh."""
DIRECTIONS = 2_000
"""Directions that represent a ball."""


@dataclass(frozen=True)
class Excess:
    """Excess [m] of the covers of one kind on one link or on all links, with the numbers of bodies
    and of uncovered pieces.
    """

    robot: str
    link: str
    kind: str
    bodies: int
    uncovered: int
    p50: float
    p99: float
    maximum: float


def shell(cover: LinkCover, rng: np.random.Generator) -> Array:
    """Points (n, 3) [m] of the surface of a capsule or hull."""
    k = np.arange(DIRECTIONS) + 0.5
    height, turn = 1 - 2 * k / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * k
    across = np.sqrt(1 - height**2)
    ball = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    core = cover.points if isinstance(cover, LinkHull) else cover.axis
    points = (core[:, None] + cover.radius * ball).reshape(-1, 3)
    hull = ConvexHull(points)
    return sampled(points[hull.simplices], int(DENSITY * hull.area), rng)


def beyond(
    covers: Sequence[LinkCover],
    meshes: Sequence[Array],
    rng: np.random.Generator,
    within: Inside = nowhere,
) -> Array:
    """Distances (n,) [m] of the outer surface of covers from meshes of triangles (t, 3, 3) [m].

    Points `within` other bodies are left out.
    """
    found = []
    for cover in covers:
        points, other_covers = shell(cover, rng), [each for each in covers if each is not cover]
        if other_covers:
            points = points[outside(points, other_covers).min(axis=0) >= 0]
        found.append(points[~within(points)])
    near = np.concatenate([sampled(each, MESH_POINTS, rng) for each in meshes])
    return np.asarray(cKDTree(near).query(np.concatenate(found))[0])


def of_robot(name: str, folder: Path, seed: int) -> list[Excess]:
    """The excess of all covers of a robot's moving links."""
    robot, rng, rows = load_robot(name), np.random.default_rng(seed), list[Excess]()
    meshes = {
        link: list(link_surfaces(folder, name, link).values()) for link in range(1, robot.nq + 1)
    }
    for (robot_name, link), lid in LIDS.items():
        if robot_name == name:
            meshes[link].append(lid)
    for kind, covers in (("capsules", robot.capsules), ("hulls", robot.hulls)):
        of_links = {link: [each for each in covers if each.link == link] for link in meshes}
        found = {
            robot.link_names[link]: _found(
                (name, robot.link_names[link], kind),
                own,
                meshes[link],
                rng,
                partial(within_neighbours, robot, link, covers),
            )
            for link, own in of_links.items()
            if own
        }
        of_kind = [row for row, _ in found.values()]
        if of_kind:
            bodies, missed = (
                sum(getattr(row, key) for row in of_kind) for key in ("bodies", "uncovered")
            )
            excess = np.concatenate([each for _, each in found.values()])
            rows += [*of_kind, _row(name, "all", kind, bodies, missed, excess)]
    return rows


def of_tool(name: str, folder: Path, seed: int) -> list[Excess]:
    """The excess of the capsules and of the hulls of a tool."""
    value = {key: figure["value"] for key, figure in tool_figures(name).items() if key != "title"}
    capsules = [LinkCapsule(0, np.reshape(row[:6], (2, 3)), row[6]) for row in value["capsules"]]
    hulls = [LinkHull(0, np.array(each), value["hull_radius"]) for each in value["hulls"]]
    tool, rng, rows = TOOL_MESHES[name], np.random.default_rng(seed), list[Excess]()
    pieces = [piece for part in tool.parts for piece in tool.swept(folder, part)]
    for kind, covers in (("capsules", capsules), ("hulls", hulls)):
        missed = sum(unproven(piece, covers, tool.sagitta(folder)) for piece in pieces)
        excess = beyond(covers, [piece.reshape(-1, 3, 3) for piece in pieces], rng, on_flange)
        rows.append(_row(name, "all", kind, len(covers), missed, excess))
    return rows


def unproven(openings: Array, covers: Sequence[LinkCover], sagitta: float) -> int:
    """The number of uncovered pieces of triangles (n, t, 3, 3) [m] between the openings of a tool.

    The paths between two openings deviate from the chords by a sagitta [m].
    """
    smaller = [replace(each, radius=each.radius - sagitta) for each in covers]
    return len(not_held(between(openings), smaller))


def _found(
    of: tuple[str, str, str],
    covers: Sequence[LinkCover],
    meshes: Sequence[Array],
    *rest: Any,
) -> tuple[Excess, Array]:
    """The row of a robot, link and kind of cover, and its distances by `beyond`."""
    missed = sum(len(not_held(m, covers)) for m in meshes)
    excess = beyond(covers, meshes, *rest)
    return _row(*of, len(covers), missed, excess), excess


def _row(name: str, link: str, kind: str, bodies: int, missed: int, excess: Array) -> Excess:
    p50, p99, most = np.percentile(excess, [50, 99, 100]).tolist()
    return Excess(name, link, kind, bodies, missed, p50, p99, most)


def exceeds(row: Excess) -> bool:
    """Whether the hulls of an arm or tool leave a piece uncovered, or exceed the limits."""
    return row.uncovered > 0 or row.p99 > LARGEST_P99 or row.maximum > LARGEST_EXCESS


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    command = parser(__doc__)
    command.add_argument(
        "--meshes", nargs="+", default=[], metavar="ROBOT=FOLDER", help="folders of meshes"
    )
    given = command.parse_args(arguments)
    folders = {name: Path(folder) for name, _, folder in (e.partition("=") for e in given.meshes)}
    if unknown := sorted(set(folders) - {*SHIFTS, *MESH_FILES, *TOOL_MESHES}):
        known = ", ".join((*SHIFTS, *MESH_FILES, *TOOL_MESHES))
        command.error(f"meshes of {', '.join(unknown)} cannot be read: give one of {known}")
    on_one_core()
    if not folders:
        found = {name: installed(name) or installed_tool(name) for name in (*SHIFTS, *TOOL_MESHES)}
        folders = {name: folder for name, folder in found.items() if folder is not None}
    rows = list[Excess]()
    print(
        f"{'robot':14}{'link':12}{'cover':10}{'bodies':>6}{'uncovered':>10}"
        f"{'p50':>6}{'p99':>6}{'max':>6} mm"
    )
    for name, folder in folders.items():
        for row in (of_tool if name in TOOL_MESHES else of_robot)(name, folder, given.seed):
            rows.append(row)
            print(
                f"{row.robot:14}{row.link:12}{row.kind:10}{row.bodies:6}{row.uncovered:10}"
                f"{1e3 * row.p50:6.1f}{1e3 * row.p99:6.1f}{1e3 * row.maximum:6.1f}",
                flush=True,
            )
    write_json(given.json, {"rows": [asdict(row) for row in rows]})
    return int(any(exceeds(row) for row in rows if row.kind == "hulls" and row.link == "all"))


if __name__ == "__main__":
    sys.exit(main())
