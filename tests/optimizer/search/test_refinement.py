"""Refinement of the best motion: cheaper baselines, other goals, energy storage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Bus, ConeOrientedPose, load_robot, optimize
from joulepath.optimizer.search import free_goal
from tests.optimizer.clocks import still
from tests.optimizer.moves import PAYLOAD, fixed, problem, tcp_pose

# relative: a spline of Ruckig's motion is slower than the motion where jumps of its jerk are close
MERGED = 2e-5
# relative: solves of one optimum end this far apart
SCATTER = 1e-3
# relative: half of what another goal saves, since optima depend on the processor
SAVED = 6e-4
ELBOW_UP = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
# jumps of jerk of this motion of Ruckig's are so close that its jerk as a spline is 6e-6 beyond the
# limit
CLOSE_JUMPS = np.array(
    [
        [
            -0.72865225814,
            0.18652150697,
            0.42934765888,
            1.10586557770,
            -1.58408477987,
            -1.51099084960,
            -0.46547461087,
        ],
        [
            -0.02886765135,
            -0.51326309981,
            0.73086005908,
            1.13263774297,
            -0.78191909962,
            -0.58701496522,
            0.28848547281,
        ],
    ]
)


def test_a_better_baseline_is_taken_even_if_rounding_breaks_a_limit() -> None:
    found = optimize(problem(*CLOSE_JUMPS, robot=load_robot("gen3")))
    assert found.certificate.valid
    assert min(each.saving for each in found.baselines if each.within_limits) > -MERGED


def test_the_goal_moves_once_more_after_the_refinement(monkeypatch: pytest.MonkeyPatch) -> None:
    """The refined motion touches other limits than the coarse motion for which the goal was chosen,
    and another goal saves 0.13 % here.
    """
    rng = np.random.default_rng(13)
    q_start, q_goal = ELBOW_UP + rng.uniform(-0.8, 0.8, (2, 6))
    position = tcp_pose(q_goal).T[:3, 3]
    down = ConeOrientedPose(position, np.array([0.0, 0, 1]), np.array([0.0, 0, -1]), np.pi)
    asked = problem(q_start, down)
    found = optimize(asked, still)
    monkeypatch.setattr(free_goal, "refine_goal_again", lambda *_: None)
    before = optimize(asked, still)
    assert found.energy.electrical.total < before.energy.electrical.total * (1 - SAVED)
    assert found.certificate.valid


@pytest.mark.long
def test_no_motion_of_near_duration_stores_more_to_advantage() -> None:
    """Where the storage just takes all surplus, the best motion needs the value of a joule of
    surplus to be nearly the highest: coarser values left 1.6 % here.
    """
    rng = np.random.default_rng(0)
    q_start, q_goal = ELBOW_UP + rng.uniform(-0.8, 0.8, (2, 6))
    bus = Bus("storage", 0.9, 5.0, 200.0)
    asked = problem(q_start, q_goal, payload=PAYLOAD, bus=bus)
    found = optimize(asked, still)
    assert found.energy.storage is not None and found.energy.storage.charged > 0
    least = found.energy.electrical.total * (1 - SCATTER)
    for ratio in (0.95, 1.05):
        other = optimize(replace(asked, **fixed(ratio * found.duration)), still)
        assert other.energy.electrical.total > least
    bounded = replace(asked, duration_min=0.99 * found.duration, duration_max=found.duration)
    within = optimize(bounded, still)
    assert bounded.duration_min is not None
    assert bounded.duration_min <= within.duration <= found.duration
    assert within.energy.electrical.total > least
