"""Replays of motions: bodies of the collision model, and meshes of the links."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.collision_replay import collisions, mesh_collisions
from joulepath import Arm, Obstacle, Scene, Sphere, capsule_between, load_robot, load_tool
from joulepath.models.meshes import link_surfaces
from joulepath.optimizer.collision.model import CollisionModel
from tests.mesh_folders import meshes
from tests.optimizer.cells import wander

ROBOT, LINK, PERIOD = load_robot("ur5e"), 3, 0.05
RADIUS = 1e-3  # m


@pytest.mark.parametrize(
    ("beyond", "of_hull", "of_mesh"), [(-RADIUS / 2, True, True), (1.5e-3, True, False)]
)
def test_an_obstacle_at_the_surface_of_a_link(beyond: float, of_hull: bool, of_mesh: bool) -> None:
    """A pea beside the forearm: in touch with the mesh, or only with the hull, which is grown."""
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
