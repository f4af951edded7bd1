"""The least displacement between boxes, against displacements of random members with every full
turn.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.least_displacement import LIMIT_TOLERANCE, least_displacement

NQ = 2
COUNT = 200
ONES = np.ones(NQ)
# a range below one turn, one of about three turns off the middle
LIMITS = Limits(np.array([-2.9, -4.0]), np.array([2.9, 14.0]), ONES, ONES, ONES, ONES)


def turned_inside(q: Array) -> list[Array]:
    """q (nq,) [rad] with every full turn inside the limits."""
    turns = (q + 2 * np.pi * np.array(each) for each in product(range(-4, 5), repeat=NQ))
    return [each for each in turns if (each >= LIMITS.q_min).all() and (each <= LIMITS.q_max).all()]


def test_no_member_is_nearer() -> None:
    rng = np.random.default_rng(1)
    start, goal = rng.uniform(-np.pi, np.pi, (2, COUNT, NQ))
    start_half, goal_half = rng.uniform(0.0, 0.5, (2, COUNT, NQ))
    least, possible = least_displacement(LIMITS, start, start_half, goal, goal_half, given=False)
    pairs = 0
    for k in range(COUNT):
        for _ in range(5):
            s, g = (
                start[k] + rng.uniform(-1, 1, NQ) * start_half[k],
                goal[k] + rng.uniform(-1, 1, NQ) * goal_half[k],
            )
            for a, b in product(turned_inside(s), turned_inside(g)):
                pairs += 1
                assert possible[k] and (np.abs(b - a) >= least[k] - 2 * LIMIT_TOLERANCE).all()
    assert pairs > COUNT


def test_a_joint_that_cannot_turn_around_has_to_go_back() -> None:
    start, goal, none = np.array([[2.5, 2.5]]), np.array([[-2.5, -2.5]]), np.zeros((1, NQ))
    least, possible = least_displacement(LIMITS, start, none, goal, none, given=True)
    assert possible.all() and np.allclose(least, [[5.0, 2 * np.pi - 5.0]])


def test_a_given_start_stands_as_it_is() -> None:
    start, goal, none = np.array([[0.0, 13.0]]), np.array([[0.0, 0.5]]), np.zeros((1, NQ))
    given, _ = least_displacement(LIMITS, start, none, goal, none, given=True)
    free, _ = least_displacement(LIMITS, start, none, goal, none, given=False)
    assert np.allclose(given, [[0.0, 13.0 - 0.5 - 4 * np.pi]]) or np.allclose(
        given, [[0.0, 0.5 + 4 * np.pi - 13.0]]
    )
    assert (free <= given + LIMIT_TOLERANCE).all()


def test_boxes_beyond_the_limits_hold_nothing() -> None:
    q = np.array([[3.1, 0.0], [2.95, 0.0]])
    half = np.full((2, NQ), 0.1)
    _, possible = least_displacement(
        LIMITS, np.zeros((2, NQ)), np.zeros((2, NQ)), q, half, given=True
    )
    assert possible.tolist() == [False, True]
