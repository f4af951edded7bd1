"""How far the capsules and the hulls of links reach beyond the meshes that they cover.

    python -m benchmarks.covers
    python -m benchmarks.covers --meshes panda=FOLDER ur10e=FOLDER

FOLDER contains the meshes of a robot as `joulepath.models.meshes` describes. Without folders, the
meshes of UR3e and UR5e are those of the package `airo-models`. For every moving link, the table has
the number of uncovered pieces of the meshes' triangles, and the excess: the distance of points of
the cover's surface from the nearest point of any mesh of the link. The exit code is 1 if a hull
leaves a piece uncovered or exceeds the limits below.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from benchmarks.command import on_one_core, parser, write_json
from joulepath.models.capsule_cover import LinkCover, not_held, outside
from joulepath.models.meshes import PANDA, SHIFTS, installed, link_surfaces, sampled
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, LinkHull

# limits of the excess of hulls [m]: 99th percentile over the surface of an arm, and maximum
P99, MOST = 3e-3, 8e-3
# points of a cover's surface per m², of every mesh, and directions that stand for a ball
DENSITY, MESH_POINTS, DIRECTIONS = 100_000, 200_000, 2_000


@dataclass(frozen=True)
class Excess:
    """Excess [m] of the covers of one kind on one link, or on all links, with the number of bodies
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


def beyond(covers: Sequence[LinkCover], meshes: Sequence[Array], rng: np.random.Generator) -> Array:
    """Distances (n,) [m] of the outer surface of covers from meshes of triangles (t, 3, 3) [m]."""
    found = []
    for cover in covers:
        points, others = shell(cover, rng), [each for each in covers if each is not cover]
        if others:
            points = points[outside(points, others).min(axis=0) >= 0]
        found.append(points)
    near = np.concatenate([sampled(each, MESH_POINTS, rng) for each in meshes])
    return np.asarray(cKDTree(near).query(np.concatenate(found))[0])


def of_robot(name: str, folder: Path, seed: int) -> list[Excess]:
    """The excess of all covers of a robot's moving links."""
    robot, rng, rows = load_robot(name), np.random.default_rng(seed), list[Excess]()
    for kind, covers in (("capsules", robot.capsules), ("hulls", robot.hulls)):
        excess, own = list[Array](), list[Excess]()
        for link in sorted({each.link for each in covers} - {0}):
            of_link = [each for each in covers if each.link == link]
            meshes = list(link_surfaces(folder, name, link).values())
            missed = sum(len(not_held(each, of_link)) for each in meshes)
            excess.append(beyond(of_link, meshes, rng))
            own.append(_row(name, robot.link_names[link], kind, len(of_link), missed, excess[-1]))
        if own:
            bodies, missed = (sum(getattr(r, key) for r in own) for key in ("bodies", "uncovered"))
            rows += [*own, _row(name, "all", kind, bodies, missed, np.concatenate(excess))]
    return rows


def _row(name: str, link: str, kind: str, bodies: int, missed: int, excess: Array) -> Excess:
    p50, p99, most = np.percentile(excess, [50, 99, 100]).tolist()
    return Excess(name, link, kind, bodies, missed, p50, p99, most)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    command = parser(__doc__)
    command.add_argument(
        "--meshes", nargs="+", default=[], metavar="ROBOT=FOLDER", help="folders of meshes"
    )
    given = command.parse_args(arguments)
    folders = {name: Path(folder) for name, _, folder in (e.partition("=") for e in given.meshes)}
    if unknown := sorted(set(folders) - {*SHIFTS, PANDA}):
        command.error(f"no meshes of {', '.join(unknown)} are read: {', '.join((*SHIFTS, PANDA))}")
    on_one_core()
    if not folders:
        folders = {name: folder for name in SHIFTS if (folder := installed(name)) is not None}
    rows = list[Excess]()
    print(
        f"{'robot':8}{'link':12}{'cover':10}{'bodies':>6}{'uncovered':>10}"
        f"{'p50':>6}{'p99':>6}{'max':>6} mm"
    )
    for name, folder in folders.items():
        for row in of_robot(name, folder, given.seed):
            rows.append(row)
            print(
                f"{row.robot:8}{row.link:12}{row.kind:10}{row.bodies:6}{row.uncovered:10}"
                f"{1e3 * row.p50:6.1f}{1e3 * row.p99:6.1f}{1e3 * row.maximum:6.1f}",
                flush=True,
            )
    write_json(given.json, {"rows": [asdict(row) for row in rows]})
    hulls = [row for row in rows if row.kind == "hulls" and row.link == "all"]
    return int(any(row.uncovered or row.p99 > P99 or row.maximum > MOST for row in hulls))


if __name__ == "__main__":
    sys.exit(main())
