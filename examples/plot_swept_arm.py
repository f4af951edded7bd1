"""Draws the volume that an arm sweeps: its capsules at some instants of the motion, the scene, and
the path of the TCP.

    .venv/bin/python -m examples.plot_swept_arm examples/optimize/bin_to_shelf.json
    docs/images/bin_to_shelf.png

The command solves the request with the library. Run it in the folder of the repository. It needs
matplotlib.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex, to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from scipy.spatial import ConvexHull

from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import TOOL
from joulepath.optimizer.problem.problem import Problem

# blue to orange of the palette of Okabe and Ito, which colour-blind readers can distinguish
OVER_TIME = LinearSegmentedColormap.from_list(
    "over time", ["#0072B2", "#56B4E9", "#F0E442", "#E69F00", "#D55E00"]
)
OBSTACLE = "#9A9A9A"
LIGHT = np.array([-0.4, -0.5, 0.77])
"""Direction of the light."""
AROUND = 14
"""Number of faces around a capsule."""
ALONG = 4
"""Number of rings of each half sphere of a capsule."""
MIDDLE = np.array([-0.3, -0.15])
"""Centre of the picture along x and y [m]."""
HALF = np.array([0.62, 0.75])
"""Half the extent of the picture along x and y [m]."""


def capsule(a: Array, b: Array, radius: float) -> list[Array]:
    """Polygons (4, 3) [m] of the surface of a capsule from a to b (3,) [m]."""
    along = b - a
    length = float(np.linalg.norm(along))
    z = along / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    turn = np.linspace(0, 2 * np.pi, AROUND + 1)
    ring = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(z, x)
    rise = np.linspace(0, np.pi / 2, ALONG)
    lower = [a + radius * (np.cos(u) * ring - np.sin(u) * z) for u in rise[::-1]]
    upper = [b + radius * (np.cos(u) * ring + np.sin(u) * z) for u in rise]
    return quads(np.array(lower + upper))


def quads(rings: Array) -> list[Array]:
    """Polygons between neighbouring points of a grid (n, m, 3)."""
    n, m, _ = rings.shape
    return [
        rings[[i, i, i + 1, i + 1], [j, j + 1, j + 1, j]]
        for i in range(n - 1)
        for j in range(m - 1)
    ]


def hull(points: Array) -> list[Array]:
    """Triangles (3, 3) of a convex hull, divided into small triangles, so that they can be sorted
    by depth.
    """
    triangles = list(points[ConvexHull(points).simplices])
    for _ in range(4):
        longest = [max(np.linalg.norm(t - np.roll(t, 1, axis=0), axis=1)) for t in triangles]
        if max(longest) < 0.12:
            break
        triangles = [part for t in triangles for part in quartered(t)]
    return triangles


def quartered(t: Array) -> list[Array]:
    """The four triangles between the corners and the midpoints of the edges of a triangle."""
    ab, bc, ca = (t + np.roll(t, -1, axis=0)) / 2
    return [
        np.array(part) for part in ([t[0], ab, ca], [ab, t[1], bc], [ca, bc, t[2]], [ab, bc, ca])
    ]


def surface(body: Body, T: Array) -> list[Array]:
    """Polygons of a body, with the frame of its link at T (4, 4)."""
    points = body.points @ T[:3, :3].T + T[:3, 3]
    if body.core.is_half_space:
        x, y = (np.linspace(m - h, m + h, 15) for m, h in zip(MIDDLE, HALF, strict=True))
        grid = np.stack([*np.meshgrid(x, y), np.zeros((15, 15))], axis=-1)
        R = (T @ body.T_link_core)[:3, :3]
        return quads(grid @ R.T + points[0])
    if body.is_segment:
        return capsule(points[0], points[-1], body.core.radius)
    if body.core.disc_radius:
        axis = (T @ body.T_link_core)[:3, :3]
        turn = np.linspace(0, 2 * np.pi, 2 * AROUND)
        circle = body.core.disc_radius * (
            np.cos(turn)[:, None] * axis[:, 0] + np.sin(turn)[:, None] * axis[:, 1]
        )
        return hull(np.concatenate([point + circle for point in points]))
    return hull(points)


def shaded(polygons: list[Array], colour: str, alpha: float) -> list[tuple[float, ...]]:
    """A colour for every polygon, lighter if the polygon faces the light."""
    colours = []
    for polygon in polygons:
        normal = np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0])
        facing = abs(float(normal @ LIGHT)) / max(float(np.linalg.norm(normal)), 1e-12)
        colours.append((*(np.asarray(to_rgb(colour), dtype=float) * (0.62 + 0.38 * facing)), alpha))
    return colours


def _surfaces(
    problem: Problem, model: CollisionModel, frames: Array
) -> tuple[list[Array], list[tuple[float, ...]]]:
    """Polygons of the bodies at all instants, and their colours."""
    instants = len(frames)
    polygons: list[Array] = []
    colours: list[tuple[float, ...]] = []

    def add(body: Body, T: Array, colour: str, alpha: float) -> None:
        faces = surface(body, T)
        polygons.extend(faces)
        colours.extend(shaded(faces, colour, alpha))

    obstacles = {obstacle.name for obstacle in problem.arm.scene.obstacles}
    for body in model.bodies:
        if body.cloud is not None or body.is_hull:
            continue
        if body.name in obstacles:
            add(body, np.eye(4), OBSTACLE, 0.18 if body.core.is_half_space else 0.4)
            continue
        # the base and the first link are drawn once, because they hardly move
        shown = range(instants) if body.link > 1 else [0]
        for k in shown:
            colour = "#666666" if body.link <= 1 else to_hex(OVER_TIME(k / (instants - 1)))
            at_end = k in (0, instants - 1) or body.link <= 1
            add(
                body,
                frames[k, body.link],
                "#333333" if body.name == TOOL and at_end else colour,
                1 if at_end else 0.22,
            )
    return polygons, colours


def draw(request: OptimizeRequest, file: Path, instants: int, view: tuple[float, float]) -> None:
    """Solves the request and draws its motion into a file."""
    problem = to_problem(request, request.deadline)
    solution = optimize(problem)
    spline = solution.trajectory.spline
    model = CollisionModel(problem.arm)
    frames = model.frames(spline.curve(np.linspace(0, spline.duration, instants)))
    polygons, colours = _surfaces(problem, model, frames)
    figure = plt.figure(figsize=(9, 7.2))
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    for body in model.bodies:
        if body.cloud is not None:
            # a cloud is drawn by the centres of its parts
            centres = body.cloud.tree.centres[body.cloud.tree.parts(body.patch)]
            axes.scatter(
                *(centres @ body.T_link_core[:3, :3].T + body.T_link_core[:3, 3]).T,
                color=OBSTACLE,
                s=2,
            )
    axes.add_collection3d(
        Poly3DCollection(polygons, facecolors=colours, edgecolors="none", zsort="average")
    )
    path = tcp_pose(problem.arm, spline.curve(np.linspace(0, spline.duration, 200)))[:, :3, 3]
    axes.plot(*path.T, color="black", linewidth=1.6, zorder=10, label="path of the TCP")
    for point, share, name in ((path[0], 0.0, "start"), (path[-1], 1.0, "goal")):
        axes.scatter(
            *point, color=to_hex(OVER_TIME(share)), edgecolors="black", s=45, zorder=11, label=name
        )
    (x_low, y_low), (x_high, y_high) = MIDDLE - HALF, MIDDLE + HALF
    axes.set(xlim=(x_low, x_high), ylim=(y_low, y_high), zlim=(-0.02, 0.88))
    axes.set_box_aspect((*(2 * HALF), 0.9), zoom=1.25)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.view_init(*view)
    axes.legend(loc="upper left", frameon=False)
    clearance = solution.certificate.clearance
    proven = (
        ""
        if clearance is None
        else f", every margin kept by {1e3 * clearance.min_clearance:.2f} mm or more"
    )
    figure.suptitle(
        f"{solution.energy.electrical.total:.1f} J in {spline.duration:.2f} s{proven}", y=0.93
    )
    figure.savefig(file, dpi=110, bbox_inches="tight")


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("request", type=Path, help="a request for POST /optimize")
    parser.add_argument("picture", type=Path, help="file for the picture")
    parser.add_argument("--instants", type=int, default=10, help="number of drawn instants")
    parser.add_argument(
        "--view", type=float, nargs=2, default=(24.0, 160.0), help="elevation and azimuth [degrees]"
    )
    given = parser.parse_args()
    request = OptimizeRequest.model_validate_json(given.request.read_text())
    draw(request, given.picture, given.instants, tuple(given.view))


if __name__ == "__main__":
    main()
