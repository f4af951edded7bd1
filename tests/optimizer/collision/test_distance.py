"""Distances against Coal, gradients against finite differences, and the selection of compared
pairs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import coal
import numpy as np
import pytest

from joulepath import (
    Arm,
    Attachment,
    Cylinder,
    Mesh,
    Obstacle,
    Payload,
    Scene,
    Sphere,
    capsule_between,
    load_robot,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.coal_distance import _lower_bound, coal_shape
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.problem.scene import Shape
from tests.optimizer.cells import LOADS, arm_in_cell
from tests.optimizer.collision.separations import separation
from tests.optimizer.moves import ROBOT
from tests.refusals import refusal_of
from tests.selection import long_but

AGREEMENT = 1e-9  # m; closed forms against Coal's, and its iterations ended at 1e-12
ITERATED = 5e-9  # m; two runs of Coal's iterations, where a round body makes them end early
STEP = 1e-6  # rad
GRADIENT = 1e-7  # m/rad; truncation STEP² · third derivative and rounding 1e-16 / STEP
ITERATED_GRADIENT = 2e-4  # m/rad; the normal is known to the root of the distance's tolerance


def configurations(count: int, seed: int = 5) -> Array:
    return np.random.default_rng(seed).uniform(-3, 3, (count, 6))


def by_coal(model: CollisionModel, q: Array) -> Array:
    """Signed distances (n, p), a pair at a time; half-spaces as in Coal."""
    request = coal.DistanceRequest(True, True)
    request.gjk_tolerance = request.epa_tolerance = 1e-12
    request.gjk_max_iterations = request.epa_max_iterations = 2000
    frames, result = model.frames(q), np.empty((len(q), len(model.pairs)))

    def standing(body: int, n: int) -> tuple[object, float, object]:
        b = model.bodies[body]
        T = frames[n, b.link] @ b.T_link_core
        stand = coal.Transform3s(T[:3, :3].copy(), T[:3, 3].copy())
        if b.core.is_half_space:
            return coal.Halfspace(np.array([0.0, 0, 1]), 0.0), b.margin, stand
        shape, skin, local = coal_shape(b.core)
        return shape, b.core.radius + b.margin - skin, stand * local

    for p, (i, k) in enumerate(model.pairs):
        for n in range(len(q)):
            (a, grown_a, T_a), (b, grown_b, T_b) = standing(i, n), standing(k, n)
            result[n, p] = (
                coal.distance(a, T_a, b, T_b, request, coal.DistanceResult()) - grown_a - grown_b
            )
    return result


@pytest.mark.parametrize("count", long_but((6,), (6, 25)))
@pytest.mark.parametrize("load", LOADS, ids=lambda shape: type(shape).__name__)
def test_distances_are_coals(load: Shape, count: int) -> None:
    model = CollisionModel(arm_in_cell(load))
    q = configurations(count)
    ours, theirs = model.signed_distances(q)[0], by_coal(model, q)
    closed = model.geometry.is_closed_form
    assert closed.sum() > 100 and (~closed).sum() > 20
    assert np.abs(ours - theirs)[:, closed].max() < AGREEMENT
    # deep inside a round body Coal's search for the depth may end nowhere
    shallow = theirs > -0.1
    assert np.abs(ours - theirs)[:, ~closed][shallow[:, ~closed]].max() < ITERATED
    assert (theirs[:, closed] < 0).sum() > 20, "also where bodies overlap"


@pytest.mark.parametrize("load", long_but(LOADS[:2], LOADS), ids=lambda shape: type(shape).__name__)
def test_gradients(load: Shape) -> None:
    model = CollisionModel(arm_in_cell(load))
    q = configurations(40)
    distance, gradient = model.signed_distances(q)
    for j in range(6):
        step = STEP * np.eye(6)[j]
        (above, _), (below, _) = model.signed_distances(q + step), model.signed_distances(q - step)
        # at a kink, such as a change of the nearest edge, the two sides differ
        smooth = np.abs(above - 2 * distance + below) < 1e-9
        error = np.abs((above - below) / (2 * STEP) - gradient[:, :, j])
        closed = smooth & model.geometry.is_closed_form
        assert closed.mean() > 0.5
        assert error[closed].max() < GRADIENT
        assert (
            error[smooth & ~model.geometry.is_closed_form & (distance > -0.05)].max(initial=0)
            < ITERATED_GRADIENT
        )


def test_far_pairs_are_bounded_from_below() -> None:
    model = CollisionModel(arm_in_cell())
    q = configurations(50)
    exact, (quick, _) = model.signed_distances(q)[0], model.signed_distances(q, within=0.1)
    assert (quick <= exact + AGREEMENT).all()
    near = quick <= 0.1
    assert np.abs((quick - exact)[near]).max() < 1e-12
    assert 0.05 < near.mean() < 0.9


def test_separation_never_exceeds_the_distance_and_attains_it() -> None:
    model, rng = CollisionModel(arm_in_cell()), np.random.default_rng(2)
    frames = model.frames(configurations(5))
    configuration, pair = (index.ravel() for index in np.indices((5, len(model.pairs))))
    found = model.geometry.witness_points(frames, configuration, pair)
    shallow = (found.distance > -0.1) | model.geometry.is_closed_form[pair]
    for case in np.flatnonzero(shallow):
        first, second = (model.bodies[k] for k in model.pairs[pair[case]])
        own, other = (frames[configuration[case], body.link] for body in (first, second))
        at_normal = separation(first, own, second, other, found.normal[case])
        assert at_normal == pytest.approx(found.distance[case], abs=ITERATED)
        normal = rng.normal(size=3)
        elsewhere = separation(first, own, second, other, normal / np.linalg.norm(normal))
        assert first.core.is_half_space or elsewhere <= found.distance[case] + ITERATED


def test_levers_are_never_exceeded() -> None:
    model = CollisionModel(arm_in_cell())
    frames, levers = model.frames(configurations(60)), model.levers()
    for (_, k), lever, between in zip(model.pairs, levers, model.joints_between, strict=True):
        body = model.bodies[k]
        T = frames[:, body.link]
        points = body.points @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
        for j in np.flatnonzero(between):
            away = points - frames[:, None, j + 1, :3, 3]
            across = np.linalg.norm(np.cross(away, frames[:, None, j + 1, :3, 2]), axis=2)
            assert across.max() + body.core.disc_radius <= lever[j] + 1e-12


def test_what_is_compared() -> None:
    model = CollisionModel(arm_in_cell())
    pairs = {model.names(p) for p in range(len(model.pairs))}
    links = load_robot("ur5e").link_names
    assert not any((a, b) in pairs for a, b in pairwise(links)), "neighbours touch"
    assert ("base", "wrist_3") in pairs and ("shoulder", "forearm") in pairs
    assert ("forearm", "wrist_2") not in pairs
    for part in ("tool", "payload"):
        assert {a for a, b in pairs if b == part} & set(links) == set(links[:-1]), (
            "all but the link that carries it"
        )
    assert ("tool", "payload") not in pairs
    assert {b for a, b in pairs if a == "floor"} == {*links[1:], "tool", "payload"}, (
        "the base does not move"
    )


@pytest.mark.parametrize("touches", [(), ("wrist_3",), ("wrist_2", "wrist_3"), ("forearm",)])
def test_what_touches_by_design_is_not_compared(touches: tuple[str, ...]) -> None:
    """Declared per body: another capsule of the tool touches the last link, unless declared
    otherwise.
    """
    ends = np.zeros(3), np.array([0, 0, 0.1])
    loaded = Arm(
        robot=ROBOT,
        tool=[capsule_between(*ends, 0.03, touches), capsule_between(*ends, 0.02)],
        payload=Payload(shape=Attachment(Sphere(0.05), touches=touches)),
    )
    model = CollisionModel(loaded)
    links = load_robot("ur5e").link_names
    first = len(ROBOT.capsules)
    compared = [
        {model.names(p)[0] for p in np.flatnonzero(model.pairs[:, 1] == first + k)}
        for k in range(3)
    ]
    assert compared == [set(links) - set(touches), set(links[:-1]), set(links) - set(touches)]


def test_what_touches_must_be_a_link() -> None:
    part = capsule_between(np.zeros(3), np.array([0, 0, 0.1]), 0.03, ["wrist_3", "table"])
    with refusal_of("tool.capsules.1.touches", match="links of the robot"):
        Arm(robot=ROBOT, tool=[capsule_between(np.zeros(3), np.ones(3), 0.03), part])
    with refusal_of("payload.touches"):
        Arm(robot=ROBOT, payload=Payload(shape=part))


@pytest.mark.parametrize("capsules", [0, 1])
def test_nothing_to_compare(capsules: int) -> None:
    robot = replace(load_robot("ur5e"), capsules=load_robot("ur5e").capsules[:capsules])
    model = CollisionModel(Arm(robot=robot))
    assert model.signed_distances(np.zeros((3, 6)))[0].shape == (3, 0)
    assert model.closest_pairs(np.zeros((2, 6))) == []


@pytest.mark.parametrize("size", [4e-4, 0.3, 90.0])
def test_any_depth_has_a_distance_and_a_normal(size: float) -> None:
    """Deep inside round bodies Coal's search may fail; the returned value never exceeds the
    distance.
    """
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T * size / 2
    shapes: list[Shape] = [
        Cylinder(size / 2, size),
        Mesh(corners * [1, 0.5, 2.0 if size < 50 else 1]),
        Cylinder(size, size),
    ]
    scene = Scene([Obstacle(f"{k}", shape) for k, shape in enumerate(shapes)])
    for load in LOADS:
        model = CollisionModel(arm_in_cell(load, scene))
        q = configurations(12)
        q[0] = 0.0
        distance, gradient = model.signed_distances(q)
        assert np.isfinite(distance).all() and np.isfinite(gradient).all()
        assert np.abs(distance).max() < 3 * size + 3


def test_a_rough_distance_is_no_more_than_the_distance() -> None:
    model = CollisionModel(arm_in_cell(LOADS[1]))
    exact, frames = model.signed_distances(configurations(20))[0], model.frames(configurations(20))
    for p in np.flatnonzero(~model.geometry.is_closed_form):
        first, second = (model.bodies[k] for k in model.pairs[p])
        grown = first.core.radius + second.core.radius + first.margin + second.margin
        for n in range(20):
            at = (
                frames[n, first.link] @ first.T_link_core,
                frames[n, second.link] @ second.T_link_core,
            )
            rough, normal, _ = _lower_bound(first.core, at[0], second.core, at[1])
            assert np.linalg.norm(normal) == pytest.approx(1)
            if exact[n, p] > -0.1:
                assert rough - grown <= exact[n, p] + ITERATED
