"""Tolerances of coordinates, of energies whose rise is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.placement.refinement import Box
from joulepath.optimizer.placement.tolerances import TOLERANCE, tolerances

LEAST = 150.0
ALLOWED = TOLERANCE.excess * LEAST
BOX = Box(np.array([-0.2]), np.array([0.3]), np.ones(1))
RISES: dict[str, tuple[Callable[[float], float], float]] = {
    "parabola": (lambda x: 400 * x**2, np.sqrt(ALLOWED / 400)),
    "even": (lambda x: 350 * abs(x), ALLOWED / 350),
    "flat": (lambda x: 0.0, 0.3),
    "step": (lambda x: 0.0 if x < 0.1 else np.inf, 0.1),
}


@pytest.mark.parametrize("name", RISES)
def test_most_of_the_tolerance_is_found(name: str) -> None:
    rise, most = RISES[name]
    tried = list[float]()

    def energy(x: Array) -> float:
        tried.append(float(x[0]))
        return LEAST + rise(float(x[0]))

    found = tolerances(energy, np.zeros(1), LEAST, BOX, np.array([0.25]))
    assert found is not None
    lower, upper = found[0]
    assert 0.5 * most < upper <= most and -0.2 <= lower < 0
    assert all(rise(x) <= ALLOWED and x in tried for x in (lower, upper))


def test_no_time_is_left() -> None:
    assert tolerances(lambda x: None, np.zeros(1), LEAST, BOX, np.array([0.1])) is None
