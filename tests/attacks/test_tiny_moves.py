"""Ends that differ by rounding, or by less than any encoder resolves."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import joulepath
from tests.selection import long_but

PLACES = {
    "ur5e": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0],
    "kr10_r1100": [0.0, -1.2, 1.3, 0.1, 0.4, 0.0],
    "panda": [0.0, -0.5, 0.2, -1.9, 0.1, 1.5, 0.3],
}
# relative: what a displacement of 1e-7 rad may add to the energy of standing still
MORE = 2e-3
# s: nothing here is to end by the deadline on a loaded machine
DEADLINE = 60.0


def energy(robot: str, displacement: float, duration: float | None) -> float:
    """Energy [J] of a motion of all joints."""
    q = np.array(PLACES[robot])
    problem = joulepath.Problem(
        arm=joulepath.Arm(robot=joulepath.load_robot(robot)),
        start=q,
        goal=q + displacement,
        duration_min=duration,
        duration_max=duration,
        deadline=DEADLINE,
    )
    return joulepath.optimize(problem, progress=False).energy.electrical.total


@pytest.mark.parametrize(
    ("robot", "duration"),
    long_but([("ur5e", None), ("panda", 1.0)], product(PLACES, (None, 1.0))),
)
def test_a_displacement_of_nothing_needs_what_standing_still_needs(
    robot: str, duration: float | None
) -> None:
    still = energy(robot, 0.0, duration)
    for displacement in (1e-16, 1e-14, 1e-12, 1e-10, 1e-9, 1e-8):
        assert energy(robot, displacement, duration) == pytest.approx(still, rel=MORE)


@pytest.mark.parametrize("robot", PLACES)
@pytest.mark.parametrize("displacement", long_but([1e-6], [1e-7, 1e-6]))
def test_a_certified_motion_is_answered_where_better_ones_are_refused(
    robot: str, displacement: float
) -> None:
    """The certificate refuses the best motion of the Panda and of the KR 10, and confirms the
    fastest one, slowed down.
    """
    still = energy(robot, 0.0, 1.0)
    assert energy(robot, displacement, 1.0) == pytest.approx(still, rel=MORE)
