"""Obstacles of many parts have the distances, proofs and checks of separate obstacles."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import coal
import numpy as np
import pytest

from joulepath import (
    Attachment,
    Box,
    Mesh,
    Obstacle,
    Points,
    Scene,
    Sphere,
    StartInCollision,
    TriangleMesh,
    Voxels,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.bounding_tree import BoundingTree, point_segment
from joulepath.optimizer.collision.clearance_proof import CLEARANCE_PROOF, proven_clearance
from joulepath.optimizer.collision.closed_form_distance import triangle_segment
from joulepath.optimizer.collision.clouds import CLOUDS, Cloud, divided
from joulepath.optimizer.collision.coal_distance import COAL, coal_shape
from joulepath.optimizer.collision.cores import Core
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.planner.state_validity import StateValidityChecker
from joulepath.optimizer.problem.clouds import CLOUD_RANGES
from joulepath.optimizer.problem.clouds import Cloud as Shape
from tests.optimizer.cells import LOADS, arm_in_cell, at, wander
from tests.optimizer.moves import GOAL, START, problem_with
from tests.refusals import refusal_of
from tests.selection import long_but

# two exact computations of one distance [m] differ by rounding, or by Coal's tolerance
ROUNDING = 1e-9
COAL_TOLERANCE = 1e-7
# a gradient by central differences of STEP [rad]: curvature of distances of centimetres, and
# rounding over the step
STEP = 1e-6
GRADIENT = 1e-4
POSE = at([0.1, -0.05, 0.2], [0.3, -0.2, 0.5])
MARGIN = 0.02


def rng(seed: int = 7) -> np.random.Generator:
    return np.random.default_rng(seed)


def around(count: int, seed: int = 7) -> Array:
    """Points within reach of the arm, but not at its base."""
    points = rng(seed).uniform(-0.9, 0.9, (20 * count, 3))
    return points[np.linalg.norm(points, axis=1) > 0.35][:count]


def box_triangles(size: Array) -> Array:
    """The twelve triangles of a box about the origin, counterclockwise as seen from outside."""
    found = []
    for axis in range(3):
        u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        for side in (-1, 1):
            centre, a, b = side * np.eye(3)[axis], u * side, v
            corner = [centre - a - b, centre + a - b, centre + a + b, centre - a + b]
            found += [[corner[0], corner[1], corner[2]], [corner[0], corner[2], corner[3]]]
    return np.array(found) * size / 2


def torus(
    around_axis: int = 24, around_tube: int = 12, ring: float = 0.3, tube: float = 0.08
) -> Array:
    """Triangles of a torus about z, counterclockwise as seen from outside."""
    turns = [np.arange(count) * 2 * np.pi / count for count in (around_axis, around_tube)]
    a, b = np.meshgrid(*turns, indexing="ij")
    radius = ring + tube * np.cos(b)
    points = np.stack([radius * np.cos(a), radius * np.sin(a), tube * np.sin(b)], axis=2)
    east, north = np.roll(points, -1, axis=0), np.roll(points, -1, axis=1)
    both = np.roll(east, -1, axis=1)
    halves = [(points, east, both), (points, both, north)]
    return np.concatenate([np.stack(half, axis=2).reshape(-1, 3, 3) for half in halves])


def shapes() -> dict[str, tuple[Shape, list[Obstacle]]]:
    """A cloud of each kind, and its parts as separate obstacles."""
    points, cells = around(60), np.floor(around(60, 8) / 0.06).astype(int)
    triangles = around(30, 9)[:, None] + rng(10).normal(size=(30, 3, 3)) * 0.04
    voxels = Voxels(0.06, cells)
    return {
        "points": (
            Points(points, 0.015),
            [part(k, Sphere(0.015), p) for k, p in enumerate(points)],
        ),
        "voxels": (
            voxels,
            [part(k, Box(np.full(3, 0.06)), (c + 0.5) * 0.06) for k, c in enumerate(voxels.cells)],
        ),
        # a triangle as a mesh of hardly any thickness
        "triangles": (
            TriangleMesh(triangles),
            [part(k, thin(t), np.zeros(3)) for k, t in enumerate(triangles)],
        ),
    }


THICKNESS = 1e-6


def thin(triangle: Array) -> Mesh:
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    normal *= THICKNESS / 2 / np.linalg.norm(normal)
    return Mesh(np.concatenate([triangle - normal, triangle + normal]))


def part(number: int, shape: Sphere | Box | Mesh, position: Array) -> Obstacle:
    return Obstacle(f"part {number}", shape, POSE @ at(position), MARGIN)


def model_of(obstacles: list[Obstacle], load: int = 0) -> CollisionModel:
    """A model of capsules alone, for comparison with clouds."""
    arm = arm_in_cell(LOADS[load], Scene(obstacles))
    return CollisionModel(replace(arm, robot=replace(arm.robot, hulls=())))


def by_body(model: CollisionModel, q: Array) -> Array:
    """Least distances (n, bodies) to the scene of every moving body."""
    distance, of_scene = (
        model.signed_distances(q)[0],
        [model.bodies[i].link == 0 for i in model.pairs[:, 0]],
    )
    names = [model.bodies[i].name for i in model.pairs[:, 0]]
    of_scene = [scene and name != "base" for scene, name in zip(of_scene, names, strict=True)]
    seconds = np.unique(model.pairs[of_scene, 1])
    return np.stack(
        [distance[:, of_scene & (model.pairs[:, 1] == k)].min(axis=1) for k in seconds], axis=1
    )


@pytest.mark.parametrize("load", range(len(LOADS)))
@pytest.mark.parametrize("kind", ["points", "voxels", "triangles"])
def test_the_distance_is_that_of_the_nearest_part(kind: str, load: int) -> None:
    shape, parts = shapes()[kind]
    q = rng().uniform(-3, 3, (25, 6))
    ours = by_body(model_of([Obstacle("cloud", shape, POSE, MARGIN)], load), q)
    theirs = by_body(model_of(parts, load), q)
    tolerance = THICKNESS if kind == "triangles" else COAL_TOLERANCE
    apart = theirs > -MARGIN  # the depth of an overlap is that of one of the parts
    assert apart.any() and np.abs(ours - theirs)[apart].max() <= tolerance
    assert (ours[~apart] <= -MARGIN + tolerance).all()


@pytest.mark.parametrize("kind", ["points", "voxels", "triangles"])
def test_gradients_are_those_of_the_distance(kind: str) -> None:
    model = model_of([Obstacle("cloud", shapes()[kind][0], POSE, MARGIN)])
    q = rng().uniform(-3, 3, (8, 6))
    distance, gradient = model.signed_distances(q)
    chosen = model.geometry.is_cloud
    for j, step in enumerate(STEP * np.eye(6)):
        above, below = (model.signed_distances(q + sign * step)[0] for sign in (1, -1))
        slope = (above - below) / (2 * STEP)
        # one-sided differences disagree if the nearest part changes within the step
        smooth = np.abs((above - distance) - (distance - below)) < STEP * GRADIENT
        error = np.abs(gradient[..., j] - slope)[:, chosen]
        kept = smooth[:, chosen] & (distance[:, chosen] > -MARGIN)
        assert kept.mean() > 0.5 and error[kept].max() < GRADIENT


def test_a_limit_gives_lower_bounds_beyond_it() -> None:
    model = model_of([Obstacle("cloud", shapes()["points"][0], POSE, MARGIN)])
    q = rng().uniform(-3, 3, (40, 6))
    exact, quick = model.signed_distances(q)[0], model.signed_distances(q, within=0.1)[0]
    near = exact <= 0.1
    assert np.abs(exact - quick)[near].max() == 0
    assert (quick <= exact + ROUNDING).all() and (quick[~near] > 0.1 - ROUNDING).all()


@pytest.mark.parametrize("count", [1, 15, 17, 300, 5000])
def test_the_tree_finds_what_a_loop_over_all_parts_finds(count: int) -> None:
    centres, radii = rng(count).uniform(-1, 1, (count, 3)), rng(count + 1).uniform(0, 0.05, count)
    tree = BoundingTree(centres, radii)
    segments = rng(2).uniform(-1, 1, (40, 2, 3))
    reach, within = np.full(40, 0.03), np.full(40, 0.1)
    distance = np.stack(
        [point_segment(centres, np.repeat(s[None], count, axis=0)) for s in segments]
    )
    roots = np.zeros(40, dtype=np.intp)
    query, found = tree.near(segments, reach, within, roots)
    expected = np.argwhere(distance - radii - 0.03 <= 0.1)
    assert sorted(zip(query.tolist(), found.tolist(), strict=True)) == [
        tuple(each) for each in expected.tolist()
    ]
    query, found = tree.near(segments, np.zeros(40), np.full(40, np.inf), roots, nearest=True)
    nearest = (distance - radii).argmin(axis=1)
    assert all(best in found[query == k] for k, best in enumerate(nearest))
    held = np.concatenate([tree.parts(node) for node in tree.patches(8)])
    assert sorted(held.tolist()) == list(range(count)) and len(tree.patches(8)) <= 8


def test_triangle_and_segment_by_coal() -> None:
    triangles, segments = (
        rng(1).normal(size=(400, 3, 3)) * 0.3,
        rng(2).normal(size=(400, 2, 3)) * 0.3,
    )
    distance, normal, point = triangle_segment(triangles, segments)
    request, crossings = coal.DistanceRequest(True, True), 0
    request.gjk_tolerance = request.epa_tolerance = 1e-10
    for k, (triangle, segment) in enumerate(zip(triangles, segments, strict=True)):
        z = (segment[1] - segment[0]) / np.linalg.norm(segment[1] - segment[0])
        x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
        x /= np.linalg.norm(x)
        R = np.column_stack([x, np.cross(z, x), z])
        capsule = coal.Capsule(COAL.skin, float(np.linalg.norm(segment[1] - segment[0])))
        theirs = coal.distance(
            coal_shape(Core(triangle))[0],
            coal.Transform3s(),
            capsule,
            coal.Transform3s(R, segment.mean(axis=0)),
            request,
            coal.DistanceResult(),
        )
        if distance[k] > 0:
            assert distance[k] - COAL.skin == pytest.approx(theirs, abs=COAL_TOLERANCE)
        else:
            crossings += 1
        # the separation along the normal attains the distance, and along no other direction it is
        # greater
        directions = np.vstack([normal[k], rng(k).normal(size=(200, 3))])
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        separation = (segment @ directions.T).min(axis=0) - (triangle @ directions.T).max(axis=0)
        assert separation[0] == pytest.approx(distance[k], abs=ROUNDING)
        assert separation.max() <= distance[k] + ROUNDING
        assert point_segment(point[k : k + 1], segment[None])[0] < ROUNDING
    assert 5 < crossings < 200


def test_divided_triangles_cover_the_same_surface() -> None:
    """Every piece lies in a triangle, and the areas of the pieces add up to the triangle's area."""
    triangles = rng(4).normal(size=(20, 3, 3)) * 0.2
    pieces = divided(triangles)

    def doubled(t: Array) -> Array:
        return np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])

    assert np.linalg.norm(pieces - np.roll(pieces, 1, axis=1), axis=2).max() <= CLOUDS.longest_edge
    areas = [np.linalg.norm(doubled(t), axis=1).sum() for t in (pieces, triangles)]
    assert areas[0] == pytest.approx(areas[1])
    # distances do not change
    segments = rng(5).normal(size=(len(pieces), 2, 3)) * 0.3
    for segment in segments[:20]:
        before = (
            triangle_segment(triangles, np.repeat(segment[None], len(triangles), axis=0))[0]
            .clip(0)
            .min()
        )
        after = (
            triangle_segment(pieces, np.repeat(segment[None], len(pieces), axis=0))[0].clip(0).min()
        )
        assert after == pytest.approx(before, abs=ROUNDING)


def test_a_closed_box_is_the_box() -> None:
    """Outside, the distance equals the box's distance; inside, it is negative at any depth."""
    size = np.array([0.5, 0.4, 0.6])
    mesh = TriangleMesh(box_triangles(size))
    assert mesh.is_closed and not TriangleMesh(box_triangles(size)[1:]).is_closed
    q = rng(3).uniform(-3, 3, (40, 6))
    ours = by_body(model_of([Obstacle("cloud", mesh, POSE @ at([0.5, 0.2, 0.2]))]), q)
    theirs = by_body(model_of([Obstacle("box", Box(size), POSE @ at([0.5, 0.2, 0.2]))]), q)
    outside = theirs > 0
    # the proof and the certificate need the sign inside: capsule radii apply only to separated
    # cores
    assert (
        np.abs(ours - theirs)[outside].max() < COAL_TOLERANCE
        and (ours[~outside] < 0).all()
        and (~outside).any()
    )


def test_the_inside_of_a_torus() -> None:
    cloud = Cloud(TriangleMesh(torus()))
    assert cloud.is_solid
    points = rng(6).uniform([-0.4, -0.4, -0.1], [0.4, 0.4, 0.1], (2000, 3))
    inside = np.zeros(len(points), dtype=bool)
    inside[cloud.inside(points)] = True
    depth = 0.08 - np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.3, points[:, 2])
    # the polygons of 24 and 12 corners differ from the torus by less than this [m]
    sagitta = 0.38 * (1 - np.cos(np.pi / 24)) + 0.08 * (1 - np.cos(np.pi / 12))
    assert (inside[depth > sagitta]).all() and not inside[depth < -sagitta].any()
    assert 0.2 < inside.mean() < 0.8


@pytest.mark.parametrize(
    ("kind", "seed"),
    long_but([("triangles", 0)], product(("points", "voxels", "triangles"), range(3))),
)
def test_the_proof_is_that_of_the_parts(kind: str, seed: int) -> None:
    shape, parts = shapes()[kind]
    motion = wander(seed, spread=0.2)
    model = model_of([Obstacle("cloud", shape, POSE, MARGIN)])
    ours, theirs = proven_clearance(model, motion), proven_clearance(model_of(parts), motion)
    assert ours is not None and theirs is not None
    slack = max(CLEARANCE_PROOF.gap, CLEARANCE_PROOF.relative_gap * abs(ours.sampled))
    assert ours.sampled - slack - ROUNDING <= ours.min_clearance <= ours.sampled
    q = motion.curve(np.linspace(0.0, motion.duration, 4001))
    least = min(model.least_distance(block, 0.05) for block in np.array_split(q, 20))
    assert ours.min_clearance <= least + ROUNDING
    if ours.sampled > -MARGIN:
        # both are proven to within their gap of the same true clearance
        assert ours.min_clearance == pytest.approx(
            theirs.min_clearance, abs=slack + THICKNESS + COAL_TOLERANCE
        )


@pytest.mark.parametrize("kind", long_but(("points",), ("points", "voxels", "triangles")))
def test_the_planner_rejects_what_collides(kind: str) -> None:
    arm = arm_in_cell(scene=Scene([Obstacle("cloud", shapes()[kind][0], POSE, MARGIN)]))
    model = CollisionModel(arm)
    checker, stricter = StateValidityChecker(arm, model), StateValidityChecker(arm, model, 5e-3)
    q = rng(12).uniform(-2.5, 2.5, (100, 6))
    distance = model.signed_distances(q)[0].min(axis=1)
    clear = np.abs(distance) > COAL_TOLERANCE
    valid = np.array([checker.is_valid(each) for each in q])
    assert (valid == (distance > 0))[clear].all() and 5 < valid.sum() < 95
    strict = np.array([stricter.is_valid(each) for each in q])
    assert (strict == (distance > 5e-3))[np.abs(distance - 5e-3) > COAL_TOLERANCE].all()


def test_two_obstacles_of_one_content_at_two_places() -> None:
    points, q = Points(around(40), 0.01), rng().uniform(-3, 3, (10, 6))
    there = POSE @ at([0.3, 0.1, -0.1], [0.0, 0.4, 0.0])
    both = by_body(
        model_of([Obstacle("one", points, POSE), Obstacle("two", points, there, MARGIN)]), q
    )
    one = by_body(model_of([Obstacle("one", points, POSE)]), q)
    two = by_body(model_of([Obstacle("two", points, there, MARGIN)]), q)
    assert np.array_equal(both, np.minimum(one, two))


def test_flat_and_single_clouds_are_obstacles() -> None:
    """Points in a plane, on a line or at one point: no box around them has a volume."""
    for points in (around(50) * [1, 1, 0], around(50) * [1, 0, 0] + [0, 0, 0.3], around(1)):
        arm = arm_in_cell(scene=Scene([Obstacle("cloud", Points(points, 0.01))]))
        model = CollisionModel(arm)
        assert np.isfinite(model.least_distance(np.zeros((1, 6)), np.inf))
        StateValidityChecker(arm, model).is_valid(np.zeros(6))
        assert proven_clearance(model, wander(1)) is not None


NAN = np.array([[0.0, np.nan, 0.0]])


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Points(np.zeros((0, 3)), 0.1), "points"),
        (lambda: Points(NAN, 0.1), "points"),
        (lambda: Points(np.zeros((2, 2)), 0.1), "points"),
        (lambda: Points(np.zeros((CLOUD_RANGES.max_points + 1, 3)), 0.1), "points"),
        (lambda: Points(np.full((1, 3), 1e3), 0.1), "points"),
        (lambda: Points(np.zeros((1, 3)), 0.0), "radius"),
        (lambda: Points(np.zeros((1, 3)), float("nan")), "radius"),
        (lambda: Voxels(0.0, np.zeros((1, 3), dtype=int)), "size"),
        (lambda: Voxels(0.1, np.zeros((0, 3), dtype=int)), "cells"),
        (lambda: Voxels(0.1, np.full((1, 3), 5000)), "cells"),
        (lambda: Voxels(10.0, np.full((1, 3), 50)), "cells"),
        (lambda: TriangleMesh(np.zeros((0, 3, 3))), "data"),
        (lambda: TriangleMesh(np.zeros((2, 3, 3))), "data"),
        (lambda: TriangleMesh(np.array([NAN.repeat(3, axis=0)])), "data"),
        (lambda: Attachment(Points(np.zeros((1, 3)), 0.1)), "shape"),
        (
            lambda: Scene(
                [
                    Obstacle(f"{k}", Points(np.zeros((CLOUD_RANGES.max_points, 3)), 0.1))
                    for k in range(3)
                ]
            ),
            "scene.obstacles",
        ),
    ],
)
def test_bad_clouds_name_the_field(make: object, field: str) -> None:
    assert callable(make)
    with refusal_of(field):
        make()


def test_the_margin_and_the_radius_are_kept() -> None:
    """A margin moves every distance by as much, and so does the radius of points."""
    points, q = around(40), rng().uniform(-3, 3, (10, 6))
    plain = by_body(model_of([Obstacle("cloud", Points(points, 0.01), POSE, 0.0)]), q)
    wide = by_body(
        model_of([replace(Obstacle("cloud", Points(points, 0.015), POSE, 0.0), margin=0.02)]), q
    )
    assert np.abs(plain - wide - 0.025).max() < ROUNDING


@pytest.mark.long
def test_an_arm_that_starts_within_a_closed_mesh_collides() -> None:
    """No surface is near: only the sign of the distance shows the collision."""
    room = np.array([6.0, 6.0, 6.0])
    within = problem_with(
        START, GOAL, scene=Scene([Obstacle("rock", TriangleMesh(box_triangles(room)))])
    )
    with pytest.raises(StartInCollision) as caught:
        optimize(within)
    assert "rock" in caught.value.pair and caught.value.depth > 1.0
    # without a wall, the surface is a room with space for the arm
    opened = Obstacle("room", TriangleMesh(box_triangles(room)[1:]))
    assert optimize(problem_with(START, GOAL, scene=Scene([opened]))).certificate.valid
