"""Link pairs excluded from collision checks never meet, proven over all angles of the joints
between.

Forearm and wrist 2, wrist 1 and wrist 3: the proof uses the convex hulls of both meshes of the
maker, which contain the links. The distance of two hulls changes by at most Σ lever_j |Δq_j|, with
lever_j the largest distance of a point of the second hull from the axis of joint j at any angle.
The distance in the middle of a cell of angles proves the whole cell, or the cell is divided.

Forearm and wrist 2 of a UR3e, a UR10e or a UR16e: the same proof with the visual meshes, because
the hulls overlap by 3 mm and 12 mm.

Base and upper arm: the proof uses the non-convex surface of the visual mesh of the upper arm, and a
cylinder around the base. The collision mesh of the upper arm is its convex hull, which fills the
hollow around the base.

Arms without freely licensed meshes: the same proof with their capsules instead of hulls.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from itertools import product
from typing import Any

import coal
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from joulepath import Robot, load_robot, robot_names
from joulepath.models.capsule_cover import cut
from joulepath.models.meshes import link_surfaces
from joulepath.models.robot import Array, LinkCapsule
from joulepath.optimizer.collision.coal_distance import coal_shape
from joulepath.optimizer.collision.cores import Core
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from tests.mesh_folders import FOUND, meshes
from tests.selection import long_but

# distances [m] proven between the links, as stated in figures.yaml
BY_HULLS = {
    ("ur5e", 3, 5): 0.005,
    ("ur5e", 4, 6): 0.010,
    ("ur3e", 4, 6): 0.010,
    ("ur10e", 4, 6): 0.020,
    ("ur16e", 4, 6): 0.020,
}
BY_MESHES = {("ur3e", 3, 5): 0.005, ("ur10e", 3, 5): 0.005, ("ur16e", 3, 5): 0.005}
BY_SURFACE = {
    ("ur5e", 0, 2): 0.005,
    ("ur3e", 0, 2): 0.005,
    ("ur10e", 0, 2): 0.005,
    ("ur16e", 0, 2): 0.005,
}
# the same of capsules, for compared pairs: the comparison rejects no configuration
BY_CAPSULES = {
    (name, *pair): 0.005 for name in ("ur15", "ur20", "ur30") for pair in ((0, 2), (4, 6))
}
# arms of the same kinematics and capsules as another
TWINS = {"ur7e": "ur5e", "ur12e": "ur10e"}
# largest edge of a piece of a surface [m], and first range of angles in the subdivision [rad]
EDGE = 4e-3
FIRST_STEP = np.deg2rad(8.0)
# height [m] of the base, above the widest part of its foot
FOOT = {"ur5e": 0.074, "ur3e": 0.03, "ur10e": 0.074, "ur16e": 0.074}


def here(pairs: Iterable[tuple[str, int, int]]) -> list[tuple[str, int, int]]:
    """The pairs of the robots with meshes on this machine."""
    return sorted(pair for pair in pairs if pair[0] in FOUND)


def first_quick(pairs: list[tuple[str, int, int]]) -> list[Any]:
    """The pairs as parameters of a test, all but the first `long`."""
    return [pytest.param(pair, marks=pytest.mark.long if k else ()) for k, pair in enumerate(pairs)]


def hull(robot: Robot, link: int) -> Array:
    """Vertices (k, 3) [m] of the convex hull of both meshes of a link."""
    surfaces = link_surfaces(meshes(robot.name), robot.name, link).values()
    points = np.concatenate([surface.reshape(-1, 3) for surface in surfaces])
    return np.asarray(points[ConvexHull(points).vertices])


def surface(robot: Robot, link: int) -> coal.CollisionGeometry:
    """The visual mesh of a link, as triangles in a tree."""
    triangles = link_surfaces(meshes(robot.name), robot.name, link)["visual"]
    points, corners = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for k, triangle in enumerate(triangles):
        points.extend(triangle)
        corners.append(coal.Triangle(3 * k, 3 * k + 1, 3 * k + 2))
    found = coal.BVHModelOBBRSS()
    found.beginModel(len(triangles), len(points))
    found.addSubModel(points, corners)
    found.endModel()
    return found


def distances(robot: Robot, first: int, second: int, angles: Array, by_meshes: bool) -> Array:
    """Distances (k,) [m] of two links, as hulls or as meshes, at angles (k, 2) [rad] of the two
    joints between them.
    """
    q = np.zeros((len(angles), robot.nq))
    q[:, first:second] = angles
    frames = link_frames(joint_placements(robot.model), q)
    shape = surface if by_meshes else lambda robot, link: coal_shape(Core(hull(robot, link)))[0]
    shapes = [shape(robot, link) for link in (first, second)]
    request, result = coal.DistanceRequest(not by_meshes, not by_meshes), []
    for k in range(len(angles)):
        poses = [
            coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3]))
            for T in frames[k, [first, second]]
        ]
        found = coal.DistanceResult()
        result.append(coal.distance(shapes[0], poses[0], shapes[1], poses[1], request, found))
    return np.array(result)


def capsule_distances(
    robot: Robot, capsules: tuple[LinkCapsule, LinkCapsule], angles: Array
) -> Array:
    """Distances (k,) [m] of two capsules at angles (k, 2) [rad] of the two joints between their
    links.
    """
    links = [capsule.link for capsule in capsules]
    q = np.zeros((len(angles), robot.nq))
    q[:, links[0] : links[1]] = angles
    frames = link_frames(joint_placements(robot.model), q)
    parts = [coal_shape(Core(capsule.axis)) for capsule in capsules]
    (one, own, T_one), (other, others, T_other) = parts
    request, result = coal.DistanceRequest(True, True), []
    for T in frames[:, links]:
        first, second = (
            coal.Transform3s(np.ascontiguousarray(P[:3, :3]), np.ascontiguousarray(P[:3, 3]))
            for P in T
        )
        result.append(
            coal.distance(
                one, first * T_one, other, second * T_other, request, coal.DistanceResult()
            )
        )
    # of the axes, slightly enlarged for coal, less both radii
    return np.array(result) + own + others - sum(capsule.radius for capsule in capsules)


def levers(robot: Robot, second: int, points: Array) -> tuple[float, float]:
    """Bounds [m] on how far points (k, 3) [m] of the second link are from the axes of the last two
    joints.
    """
    T = joint_placements(robot.model)[second - 1]
    own = float(np.linalg.norm(points[:, :2], axis=1).max())
    # at any angle of the last joint, a point stays on a circle about its axis
    centre = np.outer(points[:, 2], T[:3, 2]) + T[:3, 3]
    radius = np.linalg.norm(points[:, :2], axis=1)
    return float((np.linalg.norm(centre[:, :2], axis=1) + radius).max()), own


@pytest.mark.parametrize("pair", first_quick([*here(BY_HULLS), *here(BY_MESHES)]), ids=str)
def test_links_that_never_meet(pair: tuple[str, int, int]) -> None:
    name, first, second = pair
    robot = load_robot(name)
    reach = sum(levers(robot, second, hull(robot, second)))
    assert_apart(
        lambda cells: distances(robot, first, second, cells, by_meshes=pair in BY_MESHES),
        reach,
        (BY_HULLS | BY_MESHES)[pair],
    )


@pytest.mark.parametrize(
    ("name", "first", "second"),
    long_but([pair for pair in BY_CAPSULES if pair[0] == "ur20"], BY_CAPSULES),
)
def test_capsules_that_never_meet(name: str, first: int, second: int) -> None:
    robot = load_robot(name)
    assert (first, second) not in robot.never_in_collision
    sides = [
        [capsule for capsule in robot.capsules if capsule.link == link] for link in (first, second)
    ]
    for one, other in product(*sides):
        # by the distance of their axes: the radii do not turn
        assert_apart(
            partial(capsule_distances, robot, (one, other)),
            sum(levers(robot, second, other.axis)),
            BY_CAPSULES[name, first, second],
        )


def assert_apart(distance: Callable[[Array], Array], reach: float, kept: float) -> None:
    """Distances (k,) [m] at angles (k, 2) [rad] exceed `kept` at every angle; `reach` [m] bounds
    both slopes' sum.
    """
    half = np.pi / 24
    grid = np.arange(-np.pi + half, np.pi, 2 * half)
    cells = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    while len(cells):
        found = distance(cells)
        assert found.min() > kept
        cells = cells[found - reach * half < kept]
        half /= 2
        cells = (cells[:, None] + half * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])).reshape(
            -1, 2
        )


@pytest.mark.parametrize("pair", first_quick(here(BY_SURFACE)), ids=str)
def test_base_and_upper_arm_never_meet(pair: tuple[str, int, int]) -> None:
    """The pan joint turns about the axis of the cylinder: only the lift joint changes the
    distance."""
    name, foot = pair[0], FOOT[pair[0]]
    robot = load_robot(name)
    base = link_surfaces(meshes(name), name, 0)["visual"]
    # the base has a foot and a neck
    cylinders = [
        (np.linalg.norm(part[..., :2], axis=-1).max(), base[..., 2].min(), part[..., 2].max())
        for part in (base[base[..., 2].max(axis=1) <= foot], base[base[..., 2].max(axis=1) > foot])
    ]
    pieces = link_surfaces(meshes(name), name, 2)["visual"]
    small = []
    while len(pieces):
        edges = np.linalg.norm(pieces - np.roll(pieces, -1, axis=1), axis=2)
        small.append(pieces[edges.max(axis=1) <= EDGE])
        is_long = edges.max(axis=1) > EDGE
        pieces = cut(pieces[is_long], edges[is_long].argmax(axis=1))
    points = np.unique(np.round(np.concatenate(small).reshape(-1, 3), 3), axis=0)
    # bounds the distance of any point of the surface from a corner of its piece, and of a corner
    # from its rounded position
    spacing = EDGE / np.sqrt(3) + np.sqrt(3) / 2 * 1e-3
    lever = np.linalg.norm(points[:, :2], axis=1)
    half, placements = FIRST_STEP / 2, joint_placements(robot.model)
    # points of the surface without a proof yet, for every range of angles
    open_ranges = [
        (angle, np.arange(len(points))) for angle in np.arange(-np.pi + half, np.pi, FIRST_STEP)
    ]
    while open_ranges:
        halved = []
        for angle, which in open_ranges:
            q = np.zeros((1, robot.nq))
            q[:, 1] = angle
            T = link_frames(placements, q)[0, 2]
            x = points[which] @ T[:3, :3].T + T[:3, 3]
            least = np.full(len(which), np.inf)
            for radius, low, high in cylinders:
                away = np.maximum(np.linalg.norm(x[:, :2], axis=1) - radius, 0)
                beyond = np.maximum(np.maximum(x[:, 2] - high, low - x[:, 2]), 0)
                least = np.minimum(least, np.hypot(away, beyond) - spacing)
            assert least.min() > BY_SURFACE[pair]
            which = which[least - lever[which] * half <= BY_SURFACE[pair]]
            if len(which):
                halved += [(angle + side * half / 2, which) for side in (-1, 1)]
        open_ranges, half = halved, half / 2


@pytest.mark.parametrize("name", robot_names())
def test_all_pairs_that_are_left_out_are_proven(name: str) -> None:
    """Meshes of some robots may be missing (see `tests.mesh_folders`); otherwise the figure's note
    says that nothing is proven.
    """
    known = (*BY_HULLS, *BY_MESHES, *BY_SURFACE)
    proven = {(first, second) for robot, first, second in known if robot == TWINS.get(name, name)}
    robot = load_robot(name)
    figure = robot.figures["collision"]["never_meet"]
    assert robot.never_in_collision == proven or (
        figure["trust"] == "C" and "Not proven" in figure["note"]
    )


@pytest.mark.parametrize("name", TWINS)
def test_a_twin_has_the_same_shape(name: str) -> None:
    """A proof for one robot therefore holds for its twin."""
    robot, twin = load_robot(name), load_robot(TWINS[name])
    own, same = (
        np.array([[*each.axis.ravel(), each.radius, each.link] for each in r.capsules])
        for r in (robot, twin)
    )
    assert (own == same).all()
    hulls = zip(robot.hulls, twin.hulls, strict=True)
    assert all((one.points == other.points).all() for one, other in hulls)
    placements = zip(robot.model.jointPlacements, twin.model.jointPlacements, strict=True)
    assert all((one.homogeneous == other.homogeneous).all() for one, other in placements)
