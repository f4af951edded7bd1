"""Pictures of robots: the maker's meshes, simplified, in the frames of the links."""

from __future__ import annotations

import gzip
from io import BytesIO

import numpy as np
import pytest
import trimesh

from joulepath.models.capsule_cover import outside
from joulepath.models.meshes import link_surfaces
from joulepath.models.pictures import KIND, PICTURE, picture, picture_sources
from joulepath.models.registry import load_robot
from tests.mesh_folders import SHIPPED, meshes
from tests.selection import long_but

MOST = 400_000  # byte, compressed
# m; positions are rounded
ROUNDED = 6e-5
# m; where faces are taken away, the surface moves
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
