"""The proof over continuous time, against replays on a grid of 0.1 ms and motions of known
clearance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    Arm,
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Payload,
    Points,
    Scene,
    Sphere,
    Spline,
    load_robot,
)
from joulepath.optimizer.collision.clearance_proof import CLEARANCE_PROOF, proven_clearance
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.problem.scene import Shape
from tests.optimizer.cells import LOADS, at, cell, positions, wander
from tests.optimizer.moves import ROBOT
from tests.selection import long_but

ROUNDING = 1e-9  # m
REPLAY = 1e-4  # s
PEA = 1e-4  # m
ON_SURFACE = 1e-6  # m; Coal's own tolerance
AT = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
STILL = Spline(5, np.array([0.0] * 6 + [1.0] * 6), np.array([AT] * 6))
OBSTACLES: list[Shape] = [
    HalfSpace(),
    Sphere(0.1),
    Box(np.array([0.3, 0.2, 0.1])),
    Cylinder(0.1, 0.2),
    Capsule(0.05, 0.2),
    Mesh(np.random.default_rng(1).normal(size=(30, 3)) * 0.05),
    Points(np.array([[0.0, 0, 0], [0.02, 0, 0.01], [0.0, 0.03, 0]]), 0.01),
]


def replayed(model: CollisionModel, spline: Spline, within: float) -> float:
    """Least distance on a grid of 0.1 ms; bodies farther than `within` count by their bounding
    balls.
    """
    t = np.linspace(0, spline.duration, round(spline.duration / REPLAY) + 1)
    parts = np.array_split(positions(spline, t), 40)
    return min(float(model.signed_distances(q, within)[0].min()) for q in parts)


def smooth_cell(seed: int) -> Scene:
    """Obstacles with closed forms of distance: the replay is as exact as the proof."""
    return Scene([o for o in cell(seed).obstacles if not o.name.endswith(("2", "4"))])


@pytest.mark.parametrize("seed", long_but(range(3), range(6)))
@pytest.mark.parametrize("crowded", [False, True])
def test_proven_clearance_is_just_below_the_replay(seed: int, crowded: bool) -> None:
    arm = Arm(robot=ROBOT, scene=smooth_cell(seed)) if crowded else Arm(robot=ROBOT)
    model, spline = CollisionModel(arm), wander(seed)
    proof = proven_clearance(model, spline)
    assert proof is not None
    least = replayed(model, spline, within=max(proof.sampled, 0) + 0.01)
    assert proof.min_clearance <= least + ROUNDING
    # the replay misses the least distance by the motion in half its step: micrometres at the flat
    # minimum
    assert least <= proof.sampled + 1e-5
    gap = max(CLEARANCE_PROOF.gap, CLEARANCE_PROOF.relative_gap * abs(proof.sampled))
    assert proof.sampled - proof.min_clearance <= gap + ROUNDING


@pytest.mark.parametrize("seed", range(4))
def test_named_pair_has_that_distance_at_that_time(seed: int) -> None:
    model, spline = CollisionModel(Arm(robot=ROBOT, scene=cell(seed))), wander(seed + 100)
    proof = proven_clearance(model, spline)
    assert proof is not None
    (contact,) = model.closest_pairs(positions(spline, np.array([proof.time])))
    assert contact.pair == proof.pair
    assert contact.distance == pytest.approx(proof.sampled, abs=1e-8)


@pytest.mark.parametrize("carried", [None, *LOADS], ids=lambda shape: type(shape).__name__)
@pytest.mark.parametrize("shape", OBSTACLES, ids=lambda shape: type(shape).__name__)
def test_the_nearest_points_are_on_the_two_bodies(shape: Shape, carried: Shape | None) -> None:
    """A pea at the point of the first body is as far from the second body as the first is; one at
    the other touches.
    """
    hand = replace(ROBOT, capsules=ROBOT.capsules[-1:], hulls=())
    load = None if carried is None else Attachment(carried, at([0.0, 0, 0.2], [0.1, 0.2, 0.3]))
    payload = Payload(1.0, shape=load)
    below = at(
        [0.3, 0.2, -0.3] if isinstance(shape, HalfSpace) else [0.1, -0.3, 0.4], [0.3, 0.1, 0.2]
    )
    scene = Scene([Obstacle("thing", shape, below, margin=0.02)])
    proof = proven_clearance(CollisionModel(Arm(robot=hand, payload=payload, scene=scene)), STILL)
    assert proof is not None and proof.points is not None and proof.pair[0] == "thing"
    gap = proof.sampled + 0.02
    first, second = (np.array(point) for point in proof.points)
    assert gap > 0.01 and np.linalg.norm(second - first) == pytest.approx(gap, abs=ON_SURFACE)
    for point, expected in ((first, gap), (second, 0.0)):
        pea = Scene([Obstacle("pea", Sphere(PEA), at(point), margin=0.0)])
        model = CollisionModel(Arm(robot=hand, payload=payload, scene=pea))
        distances = model.signed_distances(positions(STILL, np.zeros(1)))[0][0]
        pairs = [model.names(k) for k in range(len(distances))]
        distance = min(
            d for d, pair in zip(distances, pairs, strict=True) if pair == ("pea", proof.pair[1])
        )
        assert distance + PEA == pytest.approx(expected, abs=ON_SURFACE)


def test_a_touch_between_samples_is_found() -> None:
    """A small ball on the path of the wrist, passed in a few milliseconds: no coarse sampling may
    miss it.
    """
    spline = wander(3, duration=0.4, spread=0.0)
    model = CollisionModel(Arm(robot=ROBOT))
    # in the middle of one of the proof's 32 initial intervals
    middle = positions(spline, np.array([0.4 * 16.5 / 32]))
    wrist = model.frames(middle)[0, 5, :3, 3]
    proof = proven_clearance(
        CollisionModel(Arm(robot=ROBOT, scene=Scene([Obstacle("pea", Sphere(0.002), at(wrist))]))),
        spline,
    )
    assert proof is not None
    assert proof.min_clearance < proof.sampled < -0.02
    assert "pea" in proof.pair


def test_turning_above_a_floor_costs_little_though_nothing_changes() -> None:
    """The pan joint alone: the distance to the floor is constant, and halving every interval would
    never end.
    """
    q_start = np.array([-2.5, -1.2, 1.5, -1.9, -1.57, 0.0])
    q_goal = q_start + np.array([5.0, 0, 0, 0, 0, 0])
    spline = Spline(5, np.array([0.0] * 6 + [2.5] * 6), np.array([q_start] * 3 + [q_goal] * 3))
    hand = replace(load_robot("ur5e"), capsules=load_robot("ur5e").capsules[-1:], hulls=())
    height = CollisionModel(Arm(robot=hand)).frames(q_start[None])[0, 6]
    floor = Obstacle("floor", HalfSpace(), at([0, 0, height[2, 3] - 0.2]), margin=0.0)
    model = CollisionModel(Arm(robot=hand, scene=Scene([floor])))
    proof = proven_clearance(model, spline)
    assert proof is not None
    capsule = hand.capsules[0]
    ends = capsule.axis @ height[:3, :3].T + height[:3, 3]
    expected = ends[:, 2].min() - capsule.radius - (height[2, 3] - 0.2)
    assert proof.sampled == pytest.approx(expected, abs=1e-12)
    assert (
        expected - CLEARANCE_PROOF.relative_gap * expected - ROUNDING
        <= proof.min_clearance
        <= expected + ROUNDING
    )


def test_standing_still() -> None:
    model = CollisionModel(Arm(robot=ROBOT))
    proof, (contact,) = proven_clearance(model, STILL), model.closest_pairs([AT])
    assert proof is not None
    assert proof.min_clearance == pytest.approx(contact.distance, abs=ROUNDING)


def test_nothing_to_compare() -> None:
    robot = replace(load_robot("ur5e"), capsules=load_robot("ur5e").capsules[:1])
    assert proven_clearance(CollisionModel(Arm(robot=robot)), wander(1)) is None
