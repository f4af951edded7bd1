"""Replays of motions by bodies of the collision model and by meshes, and the excess of covers
beyond meshes.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from benchmarks.collision_replay import collisions, mesh_collisions
from benchmarks.command import THREADS
from benchmarks.covers import beyond, main
from joulepath import Arm, Obstacle, Scene, Sphere, capsule_between, load_robot, load_tool
from joulepath.models.capsule_cover import within_neighbours
from joulepath.models.meshes import MESH_FILES, link_surfaces
from joulepath.models.robot import Array, LinkCapsule, LinkHull
from joulepath.models.tool_meshes import TOOL_MESHES
from joulepath.optimizer.collision.model import CollisionModel
from tests.mesh_folders import SHIPPED_TOOLS, meshes
from tests.optimizer.cells import wander

ROBOT = load_robot("ur5e")
LINK = 3
PERIOD = 0.05
RADIUS = 1e-3  # m


@pytest.mark.parametrize(
    ("beyond", "of_hull", "of_mesh"), [(-RADIUS / 2, True, True), (1.5e-3, True, False)]
)
def test_an_obstacle_at_the_surface_of_a_link(beyond: float, of_hull: bool, of_mesh: bool) -> None:
    """A pea beside the forearm, in contact with the mesh, or only with the enlarged hull."""
    surfaces = list(link_surfaces(meshes("ur5e"), "ur5e", LINK).values())
    corners = np.concatenate(surfaces).reshape(-1, 3)
    farthest = corners[corners[:, 2].argmax()]
    spline = wander(2, duration=1.0)
    arm = Arm(robot=ROBOT)
    T = CollisionModel(arm).frames(spline.curve(np.zeros(1)))[0, LINK]
    at = np.eye(4)
    at[:3, 3] = T[:3, :3] @ (farthest + np.array([0.0, 0.0, RADIUS + beyond])) + T[:3, 3]
    arm = Arm(robot=ROBOT, scene=Scene([Obstacle("pea", Sphere(RADIUS), at, margin=0.0)]))
    assert (collisions(arm, spline, PERIOD) > 0) == of_hull
    assert (mesh_collisions(arm, {LINK: surfaces}, spline, PERIOD) > 0) == of_mesh


def test_a_tool_is_replayed_with_the_meshes() -> None:
    spline = wander(2, duration=1.0)
    rod = capsule_between(np.array([0.0, 0.0, 0.1]), np.array([0.0, 0.0, 0.2]), 2e-3)
    arm = Arm(robot=ROBOT, tool=[rod])
    T = CollisionModel(arm).frames(spline.curve(np.zeros(1)))[0, -1] @ ROBOT.T_last_flange
    for height, hit in ((0.15, True), (0.2 + 2e-3 + 3 * RADIUS, False)):
        at = np.eye(4)
        at[:3, 3] = (T @ [0.0, 0.0, height, 1.0])[:3]
        scene = Scene([Obstacle("pea", Sphere(RADIUS), at, margin=0.0)])
        found = mesh_collisions(Arm(robot=ROBOT, tool=[rod], scene=scene), {}, spline, 1.0)
        assert (found > 0) == hit


def test_a_tool_is_replayed_with_its_hulls() -> None:
    """A pea beside the fingers of a Robotiq 2F-85 is free, within the reach of its capsules."""
    spline, tool = wander(2, duration=1.0), load_tool("robotiq_2f_85").shape
    capsules = tuple(part for part in tool if not part.is_hull)
    at = CollisionModel(Arm(robot=ROBOT)).frames(spline.curve(np.zeros(1)))[0, -1]
    at = at @ ROBOT.T_last_flange
    at[:3, 3] = (at @ [0.015, 0.058, 0.15, 1.0])[:3]
    scene = Scene([Obstacle("pea", Sphere(RADIUS), at, margin=0.0)])
    for shape, hit in ((tool, False), (capsules, True)):
        arm = Arm(robot=ROBOT, tool=shape, scene=scene)
        assert (mesh_collisions(arm, {}, spline, 2.0) > 0) == hit


# m; between samples of the mesh, and of the ball by flat triangles
SAMPLED = 4e-4


def ball(radius: float) -> Array:
    """Triangles (t, 3, 3) [m] of a ball."""
    points = np.random.default_rng(0).normal(size=(4000, 3))
    points *= radius / np.linalg.norm(points, axis=1)[:, None]
    return np.asarray(points[ConvexHull(points).simplices])


def test_the_excess_is_the_distance_between_the_surfaces() -> None:
    """A ball of 50 mm within a concentric one of 55 mm, and within a cube enlarged by 5 mm."""
    mesh, rng = ball(0.05), np.random.default_rng(1)
    found = beyond([LinkCapsule(1, np.zeros((2, 3)), 0.055)], [mesh], rng)
    assert found == pytest.approx(np.full(len(found), 5e-3), abs=SAMPLED)
    cube = 0.05 * (np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T)
    found = beyond([LinkHull(1, cube, 0.005)], [mesh], rng)
    assert found.min() == pytest.approx(5e-3, abs=SAMPLED)
    assert found.max() == pytest.approx(0.05 * np.sqrt(3) + 0.005 - 0.05, abs=SAMPLED)


def test_what_another_cover_contains_is_no_excess() -> None:
    """Two equal balls side by side: either one hides a part of the other."""
    ends = [np.tile([x, 0.0, 0.0], (2, 1)) for x in (-0.02, 0.02)]
    covers = [LinkCapsule(1, end, 0.055) for end in ends]
    found = beyond(covers, [ball(0.05)], np.random.default_rng(1))
    assert found.max() == pytest.approx(0.025, abs=SAMPLED)
    assert found.min() >= np.sqrt(0.055**2 - 0.02**2) - 0.05 - SAMPLED


def test_a_robot_without_readable_meshes_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--meshes", "ur15=."])
    assert "ur15" in capsys.readouterr().err


FOUND = [
    name
    for name in (*MESH_FILES, *TOOL_MESHES)
    if name in SHIPPED_TOOLS or (Path(os.environ.get("ROBOT_MESHES", "")) / name).is_dir()
]


@pytest.mark.long
@pytest.mark.parametrize("name", FOUND)
def test_the_hulls_of_an_arm_or_tool_are_proven_and_within_the_limits(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # otherwise the command would start this process again
    for each in THREADS:
        monkeypatch.setenv(each, "1")
    assert main(["--meshes", f"{name}={meshes(name)}"]) == 0


def test_points_within_a_neighbour_at_every_angle_are_no_excess() -> None:
    """A ball around the origin of the next link's joint hides points on this joint's axis, but not
    points beyond its reach at every angle.
    """
    robot = load_robot("ur5e")
    joint = robot.model.jointPlacements[3]
    axis = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.2]])
    off_axis = LinkCapsule(3, np.array([[0.03, 0.0, 0.0], [0.03, 0.0, 0.0]]), 0.05)
    points = axis @ joint.rotation.T + joint.translation
    assert within_neighbours(robot, 2, [off_axis], points).tolist() == [True, False]
    # inside the ball at some angles only
    beside = np.array([[0.06, 0.0, 0.0]]) @ joint.rotation.T + joint.translation
    assert not within_neighbours(robot, 2, [off_axis], beside).any()
    assert not within_neighbours(robot, 2, [replace(off_axis, link=4)], points).any()
