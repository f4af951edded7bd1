"""Containment in capsules: the proof over whole triangles against sampled surface points, and
robots against their meshes.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.capsule_cover import SMALLEST, not_held, outside
from joulepath.models.meshes import KINDS, link_surfaces, sampled
from joulepath.models.robot import Array, LinkCapsule, Robot
from joulepath.optimizer.problem.robots import load_robot
from tests.mesh_folders import FOUND, meshes
from tests.selection import long_but

# m; double precision of sums of a few squares of lengths below 1 m
ROUNDING = 1e-12
ROBOTS = [load_robot(name) for name in FOUND]


def label(value: object) -> str:
    return value.name if isinstance(value, Robot) else str(value)


def capsule(begin: list[float], end: list[float], radius: float) -> LinkCapsule:
    return LinkCapsule(1, np.array([begin, end]), radius)


def triangles(*corners: list[list[float]]) -> Array:
    return np.array(corners, dtype=float)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("robot", "link"),
    long_but(
        [(ROBOTS[0], link) for link in range(0, ROBOTS[0].nq + 1, 2)],
        [(robot, link) for robot in ROBOTS for link in range(robot.nq + 1)],
    ),
    ids=label,
)
def test_capsules_hold_every_surface(robot: Robot, link: int, kind: str) -> None:
    """Every triangle of the maker's meshes, wherever it is: no point is sampled."""
    capsules = [each for each in robot.capsules if each.link == link]
    surface = link_surfaces(meshes(robot.name), robot.name, link)[kind]
    assert len(surface) > 100
    assert not len(not_held(surface, capsules))
    # the same with points of the surfaces, precise enough to detect a radius 2 mm too small
    points = sampled(surface, 20_000, np.random.default_rng(3))
    assert outside(points, capsules).min(axis=0).max() <= ROUNDING


@pytest.mark.parametrize(
    ("robot", "number"),
    long_but(
        [(ROBOTS[0], number) for number in range(0, len(ROBOTS[0].capsules), 4)],
        [(robot, number) for robot in ROBOTS for number in range(len(robot.capsules))],
    ),
    ids=label,
)
def test_no_capsule_is_idle(robot: Robot, number: int) -> None:
    """Every capsule is needed: with any radius 2 mm smaller, a part of a surface is outside."""
    own = robot.capsules[number]
    others = [each for each in robot.capsules if each.link == own.link and each is not own]
    smaller = LinkCapsule(own.link, own.axis, own.radius - 2e-3)
    surfaces = link_surfaces(meshes(robot.name), robot.name, own.link)
    assert any(len(not_held(surface, [smaller, *others])) for surface in surfaces.values())


def test_a_triangle_between_two_capsules_is_not_held() -> None:
    """All corners are inside; the middle of the long edges is not."""
    ends = [capsule([0, 0, 0], [0, 0, 0], 0.1), capsule([1, 0, 0], [1, 0, 0], 0.1)]
    bridge = triangles([[0, 0, 0], [1, 0, 0], [0, 0.01, 0]])
    assert (outside(bridge.reshape(-1, 3), ends).min(axis=0) < 0).all()
    assert len(not_held(bridge, ends))
    assert not len(not_held(bridge, [*ends, capsule([0, 0, 0], [1, 0, 0], 0.02)]))


def test_a_triangle_over_several_capsules_is_held() -> None:
    """No single capsule contains it."""
    row = [capsule([x, 0, 0], [x, 0.2, 0], 0.1) for x in (0.0, 0.15, 0.3)]
    across = triangles([[0, 0, 0], [0.3, 0, 0], [0.15, 0.2, 0.02]])
    assert all(len(not_held(across, [each])) for each in row)
    assert not len(not_held(across, row))
    assert len(not_held(across, [row[0], row[2]]))


def test_a_gap_below_the_resolution_is_found() -> None:
    """Two balls with a gap smaller than SMALLEST: a piece over the gap is never contained."""
    balls = [
        capsule([s * (0.1 + SMALLEST / 4), 0, 0], [s * (0.1 + SMALLEST / 4), 0, 0], 0.1)
        for s in (-1, 1)
    ]
    assert len(not_held(triangles([[-0.05, 0, 0], [0.05, 0, 0], [0.05, 1e-9, 0]]), balls))


def test_what_is_held_has_no_point_outside() -> None:
    """Random capsules and triangles: the proof agrees with dense samples; triangles without a proof
    are outside or on the rim.
    """
    rng = np.random.default_rng(8)
    held = 0
    for _ in range(200):
        capsules = [capsule(*rng.uniform(-0.1, 0.1, (2, 3)).tolist(), 0.08) for _ in range(3)]
        triangle = rng.uniform(-0.12, 0.12, (1, 3, 3))
        missed = not_held(triangle, capsules)
        if len(missed):
            assert outside(missed.reshape(-1, 3), capsules).min(axis=0).max() > -SMALLEST
        else:
            held += 1
            assert outside(sampled(triangle, 3000, rng), capsules).min(axis=0).max() <= ROUNDING
    assert 20 < held < 180


def test_distances_are_those_of_a_capsule() -> None:
    tube = capsule([0, 0, 0], [0, 0, 1], 0.25)
    points = np.array([[0.5, 0, 0.5], [0, 0, 1.5], [0, 0.1, 0.2], [0, 0.3, -0.4]])
    assert outside(points, [tube])[0] == pytest.approx([0.25, 0.25, -0.15, 0.25])
