"""Close passes: a ball at a known distance from the arm, with and without margins; the arm near
itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Clearance, Obstacle, Scene, Sphere, Waypoints, evaluate
from joulepath.models.robot import Array
from joulepath.optimizer.collision.clearance_proof import CLEARANCE_PROOF, proven_clearance
from joulepath.optimizer.collision.close_pass import CLOSE_PASS, close_pass
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.motion.time_scalings import quintic_spline
from tests.optimizer.cells import at
from tests.optimizer.moves import ROBOT

# only the pan joint turns: bodies on its axis keep their distance from the arm
START = np.array([-0.5, -1.4, 1.6, -1.7, -1.57, 0.0])
GOAL = START + np.array([1.0, 0, 0, 0, 0, 0])
MOTION = quintic_spline(START, GOAL, 1.0)
BALL = 0.05
# m; the proof ends this far below the distance at the latest
PROOF = max(CLEARANCE_PROOF.gap, CLEARANCE_PROOF.relative_gap * CLOSE_PASS.distance)


def on_the_axis(distance: float, margin: float) -> Arm:
    """A ball on the axis of the base, `distance` [m] above the arm at START, found by bisection."""

    def ball(height: float, kept: float) -> Obstacle:
        return Obstacle("ball", Sphere(BALL), at([0, 0, height]), kept)

    def away(height: float) -> float:
        model = CollisionModel(Arm(robot=ROBOT, scene=Scene([ball(height, 0.0)])))
        of_ball = [p for p in range(len(model.pairs)) if "ball" in model.names(p)]
        return float(model.signed_distances(START[None])[0][0, of_ball].min())

    low, high = 0.3, 1.5
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if away(middle) < distance else (low, middle)
    return Arm(robot=ROBOT, scene=Scene([ball(high, margin)]))


def found(arm: Arm) -> Clearance | None:
    return close_pass(arm, MOTION, proven_clearance(CollisionModel(arm), MOTION))


@pytest.mark.parametrize("distance", [1e-4, 1e-3, 1.8e-3])
def test_a_pass_below_the_threshold_is_found(distance: float) -> None:
    near = found(on_the_axis(distance, 0.0))
    assert near is not None and "ball" in near.pair
    assert near.sampled == pytest.approx(distance, abs=1e-6)
    assert distance - PROOF <= near.min_clearance <= distance + 1e-6


@pytest.mark.parametrize("margin", [0.0, CLOSE_PASS.distance, 5e-3])
def test_a_pass_above_it_is_not(margin: float) -> None:
    assert found(on_the_axis(CLOSE_PASS.distance + 1.1 * PROOF, margin)) is None


@pytest.mark.parametrize("margin", [1e-3, 1.99e-3])
def test_distances_are_those_without_margins(margin: float) -> None:
    """Beyond its margin the ball has no clearance; the distance is the margin."""
    near = found(on_the_axis(margin, margin))
    assert near is not None
    assert near.sampled == pytest.approx(margin, abs=1e-6)


def test_a_margin_hides_no_other_pass() -> None:
    """One ball touches its margin of 5 mm, another one without a margin is 1 mm away: the second is
    named.
    """
    kept, free = on_the_axis(5e-3, 5e-3), on_the_axis(1e-3, 0.0)
    (wide,), (bare,) = kept.scene.obstacles, free.scene.obstacles
    both = replace(kept, scene=Scene([wide, replace(bare, name="bare")]))
    proof = proven_clearance(CollisionModel(both), MOTION)
    assert proof is not None and "ball" in proof.pair
    near = found(both)
    assert near is not None and "bare" in near.pair


def folded_to(distance: float) -> Array:
    """Joint positions (6,) [rad] with the elbow folded until two links are `distance` [m] apart."""
    model = CollisionModel(Arm(robot=ROBOT))

    def configuration(elbow: float) -> Array:
        return np.array([0.0, -1.57, elbow, 0.0, 1.57, 0.0])

    low, high = 1.0, 3.1
    for _ in range(50):
        middle = (low + high) / 2
        is_clear = model.closest_pairs([configuration(middle)])[0].distance > distance
        low, high = (middle, high) if is_clear else (low, middle)
    return configuration(low)


def test_the_arm_itself_is_passed_closely() -> None:
    """The arm is folded until two links are 1 mm apart."""
    folded = folded_to(1e-3)
    motion = quintic_spline(folded - np.array([0, 0, 0.3, 0, 0, 0]), folded, 1.0)
    arm = Arm(robot=ROBOT)
    near = close_pass(arm, motion, proven_clearance(CollisionModel(arm), motion))
    assert near is not None and set(near.pair) <= set(ROBOT.link_names)
    assert near.sampled == pytest.approx(1e-3, abs=1e-6)
    assert near.time == pytest.approx(1.0)


def test_nothing_is_compared_without_collisions() -> None:
    assert close_pass(on_the_axis(1e-3, 0.0), MOTION, None) is None


@pytest.mark.parametrize(
    ("distance", "margin", "is_close"), [(1e-3, 0.0, True), (1e-3, 5e-3, False), (3e-3, 0, False)]
)
def test_a_given_motion_is_sampled(distance: float, margin: float, is_close: bool) -> None:
    """For an obstacle with a margin, `nearest` states whether the margin is kept."""
    motion = Waypoints(np.array([START, GOAL]), np.array([1.0]), "quintic", 0)
    result = evaluate(on_the_axis(distance, margin), motion)
    assert result.nearest is not None
    assert result.nearest.distance == pytest.approx(distance - margin, abs=1e-6)
    assert (result.close_pass is not None) == is_close
    if result.close_pass is not None:
        assert result.close_pass.distance == pytest.approx(distance, abs=1e-6)
        assert "ball" in result.close_pass.pair
