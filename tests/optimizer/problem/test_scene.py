"""Shapes and scenes: what is accepted, and what is refused with the field named."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from joulepath.optimizer.collision.cores import core_of
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.scene import (
    SCENE_RANGES,
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Scene,
    Sphere,
    capsule_between,
)

NAN = float("nan")
CUBE = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T * 0.2
ROUNDING = 1e-15


@pytest.mark.parametrize("bad", [0.0, -1.0, NAN, float("inf"), 1e-9, 1e6])
def test_sizes(bad: float) -> None:
    makers: list[Callable[[], object]] = [
        lambda: Sphere(bad),
        lambda: Capsule(bad, 0.1),
        lambda: Capsule(0.1, bad),
        lambda: Cylinder(bad, 0.1),
        lambda: Cylinder(0.1, bad),
        lambda: Box(np.array([0.1, bad, 0.1])),
    ]
    for make in makers:
        with pytest.raises(InvalidProblem):
            make()


@pytest.mark.parametrize(
    "vertices",
    [
        CUBE[:3],
        CUBE * [1, 1, 0],
        CUBE * [1, 0, 0],
        np.full((8, 3), 0.3),
        CUBE * [1, NAN, 1],
        CUBE * 1e9,
        np.ones((SCENE_RANGES.max_vertices + 1, 3)),
        np.zeros((5, 2)),
        "vertices",
        [[0, 0, 0], [1, 0]],
    ],
    ids=[
        "three",
        "flat",
        "on a line",
        "one point",
        "nan",
        "huge",
        "many",
        "two columns",
        "text",
        "ragged",
    ],
)
def test_meshes_without_a_body(vertices: object) -> None:
    with pytest.raises(InvalidProblem):
        Mesh(vertices)  # type: ignore[arg-type]


def test_mesh_keeps_its_hull_alone() -> None:
    mesh = Mesh(np.vstack([CUBE, [[0.1, 0.1, 0.1], [0.05, 0.1, 0.15]]]))
    assert sorted(map(tuple, mesh.vertices.tolist())) == sorted(map(tuple, CUBE.tolist()))
    assert not mesh.vertices.flags.writeable


def test_scenes() -> None:
    obstacles = [Obstacle(f"post {k}", Sphere(0.1)) for k in range(SCENE_RANGES.max_obstacles)]
    assert len(Scene(obstacles).obstacles) == SCENE_RANGES.max_obstacles
    with pytest.raises(InvalidProblem, match="at most"):
        Scene([*obstacles, Obstacle("one more", Sphere(0.1))])
    with pytest.raises(InvalidProblem, match="same name"):
        Scene([obstacles[0], Obstacle("post 0", HalfSpace())])


@pytest.mark.parametrize("margin", [-0.1, NAN, 2.0])
def test_margins_out_of_range(margin: float) -> None:
    with pytest.raises(InvalidProblem, match="margin"):
        Obstacle("post", Sphere(0.1), margin=margin)


def test_an_obstacle_asks_for_five_millimetres_unless_told_otherwise() -> None:
    assert Obstacle("post", Sphere(0.1)).margin == 0.005
    assert Obstacle("post", Sphere(0.1), margin=0.0).margin == 0.0


@pytest.mark.parametrize(
    "T", [np.eye(3), 2 * np.eye(4), np.diag([1.0, 1, -1, 1]), np.full((4, 4), NAN)]
)
def test_poses(T: np.ndarray) -> None:
    with pytest.raises(InvalidProblem):
        Obstacle("post", Sphere(0.1), T)
    with pytest.raises(InvalidProblem):
        Attachment(Sphere(0.1), T)


def test_half_spaces_are_not_carried() -> None:
    with pytest.raises(InvalidProblem, match="carried"):
        Attachment(HalfSpace())


def test_capsule_between_two_points() -> None:
    first, second = np.array([0.1, -0.2, 0.3]), np.array([-0.05, 0.1, 0.35])
    part = capsule_between(first, second, 0.04)
    T = part.T_flange_shape
    ends = core_of(part.shape).points @ T[:3, :3].T + T[:3, 3]
    assert np.abs(ends - [first, second]).max() < ROUNDING * 10
    assert isinstance(capsule_between(first, first, 0.04).shape, Sphere)
