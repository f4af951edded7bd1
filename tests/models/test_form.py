"""The drawn form of an arm lies at its collision capsules; pictures are drawn from the makers'
meshes.
"""

from __future__ import annotations

import gzip
from io import BytesIO

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from joulepath.models.capsule_cover import outside
from joulepath.models.form import link_bodies
from joulepath.models.meshes import link_surfaces
from joulepath.models.pictures import KIND, PICTURE, picture, picture_sources
from joulepath.models.robot import Array
from joulepath.optimizer.problem.robots import load_robot
from tests.mesh_folders import SHIPPED, meshes
from tests.selection import ROBOTS, long_but

# m; sums of some ten products in double precision
ROUNDING = 1e-9
# of the radius: how far the middle of a body may be outside of the capsules; one of the xArm is by
# 0.33
OUTSIDE = 0.35


def distance(point: Array, capsule: Array) -> float:
    """Distance [m] from a point (3,) to the surface of a capsule (7,); negative inside."""
    start, axis = capsule[:3], capsule[3:6] - capsule[:3]
    share = np.clip((point - start) @ axis / max(axis @ axis, 1e-12), 0, 1)
    return float(np.linalg.norm(point - start - share * axis) - capsule[6])


@pytest.mark.parametrize("name", ROBOTS)
def test_housings_meet_on_the_axis_of_each_joint(name: str) -> None:
    robot = load_robot(name)
    bodies = link_bodies(robot.figures)
    assert len(bodies) == robot.nq + 1
    for joint, row in enumerate(robot.figures["kinematics"]["joint_origin"]["value"]):
        T = pin.SE3(pin.rpy.rpyToMatrix(*row[3:]), np.array(row[:3]))
        (ring,) = (body for body in bodies[joint] if body.kind == "ring")
        middle = (np.array(ring.start) + ring.end) / 2
        assert T.actInv(middle)[:2] == pytest.approx(0, abs=ROUNDING), "on the axis"
        # in the frame of the next link, at the start of its own housing
        ends = [T.act(np.array(body.start)) for body in bodies[joint + 1] if body.kind == "housing"]
        assert min(np.linalg.norm(end - middle) for end in ends) == pytest.approx(0, abs=ROUNDING)


@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_drawn_is_where_collision_checks_see_the_arm(name: str) -> None:
    robot = load_robot(name)
    names = ["base", *robot.figures["kinematics"]["link_names"]["value"]]
    for link, own in zip(names, link_bodies(robot.figures), strict=True):
        capsules = np.array(robot.figures["collision"].get(link, {}).get("value", [])).reshape(
            -1, 7
        )
        for body in own:
            assert body.radius > 0
            if len(capsules) and body.kind in ("housing", "tube"):
                middle = (np.array(body.start) + body.end) / 2
                assert min(distance(middle, each) for each in capsules) <= OUTSIDE * body.radius, (
                    link,
                    body,
                )


MOST = 400_000  # byte, compressed
# m; positions are rounded
ROUNDED = 6e-5
# m; the surface moves at removed faces
MOVED = 5e-3


@pytest.mark.parametrize("name", long_but(SHIPPED[:1], SHIPPED))
def test_every_link_stands_in_its_capsules(name: str) -> None:
    robot = load_robot(name)
    content = picture(name)
    assert len(gzip.compress(content)) < MOST
    scene = trimesh.load_scene(BytesIO(content), file_type="glb")
    links = ["base", *robot.figures["kinematics"]["link_names"]["value"]]
    assert list(scene.geometry) == links
    count = 0
    for link, node in enumerate(links):
        mesh = scene.geometry[node]
        T, _ = scene.graph[node]
        assert np.array_equal(T, np.eye(4))
        capsules = [each for each in robot.capsules if each.link == link]
        assert outside(mesh.vertices, capsules).min(axis=0).max() < ROUNDED
        # as large as the whole mesh, too
        whole = link_surfaces(meshes(name), name, link)[KIND].reshape(-1, 3)
        assert np.allclose(mesh.bounds, [whole.min(axis=0), whole.max(axis=0)], atol=MOVED)
        assert np.allclose(np.linalg.norm(mesh.vertex_normals, axis=1), 1, atol=1e-6)
        count += len(mesh.faces)
    assert PICTURE.faces / 2 < count < 1.6 * PICTURE.faces


def test_a_robot_without_meshes_has_no_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    assert picture_sources("panda") is picture_sources("../ur5e") is None
    assert picture_sources("ur5e")
    monkeypatch.setattr("joulepath.models.pictures.find_spec", lambda name: None)
    assert picture_sources("ur5e") is None
