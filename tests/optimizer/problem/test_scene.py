"""Shapes, scenes and homogeneous bodies: their moments, and refusals that name the field."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    InvalidProblem,
    Mesh,
    Obstacle,
    Payload,
    Scene,
    Sphere,
    capsule_between,
    even_payload,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.cores import core_of
from joulepath.optimizer.problem.scene import SCENE_RANGES, Shape

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


MASS = 2.5
OF_SUMS = 1e-12  # relative, of sums of a few hundred products
SIZE = np.array([0.06, 0.1, 0.2])
CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T / 2 * SIZE
PLACE = pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.7, 1.1), np.array([0.02, -0.03, 0.12]))


def body(payload: Payload) -> pin.Inertia:
    return pin.Inertia(payload.mass, payload.com, payload.inertia)


def check(payload: Payload, expected: pin.Inertia) -> None:
    assert payload.mass == pytest.approx(expected.mass, rel=OF_SUMS)
    np.testing.assert_allclose(payload.com, expected.lever, atol=OF_SUMS)
    np.testing.assert_allclose(payload.inertia, expected.inertia, atol=OF_SUMS)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (Box(SIZE), pin.Inertia.FromBox(MASS, *SIZE)),
        (Sphere(0.05), pin.Inertia.FromSphere(MASS, 0.05)),
        (Cylinder(0.04, 0.15), pin.Inertia.FromCylinder(MASS, 0.04, 0.15)),
        (Capsule(0.04, 0.15), pin.Inertia.FromCapsule(MASS, 0.04, 0.15)),
        (Mesh(CORNERS), pin.Inertia.FromBox(MASS, *SIZE)),
    ],
    ids=lambda each: type(each).__name__,
)
def test_centre_and_inertia_are_those_of_the_shape_at_its_pose(
    shape: Shape, expected: pin.Inertia
) -> None:
    check(even_payload(MASS, Attachment(shape, PLACE.homogeneous)), PLACE.act(expected))


def test_a_hull_may_lie_anywhere_about_its_origin() -> None:
    """Two parts of a box, each about its own centre, have the moments of the box."""
    cut = np.array([0.0, 0.0, SIZE[2] / 2])
    parts = (SIZE * [1, 1, 0.75], SIZE * [1, 1, 0.25])
    middles = (-cut + [0, 0, parts[0][2] / 2], cut - [0, 0, parts[1][2] / 2])

    def part(share: float, size: Array, middle: Array) -> pin.Inertia:
        hull = Mesh(CORNERS / SIZE * size + middle)
        return body(even_payload(share * MASS, Attachment(hull)))

    (long, short), shares = zip(parts, middles, strict=True), (0.75, 0.25)
    whole = part(shares[0], *long) + part(shares[1], *short)
    check(even_payload(MASS, Attachment(Box(SIZE))), whole)
