"""Intervals of several savings at once."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.uncertainty.parameters import count
from joulepath.optimizer.dynamics.interval import MotionEnergy, saving_interval, saving_intervals
from joulepath.optimizer.result.energy import Sensitivity
from tests.optimizer.moves import problem


def test_several_savings_are_each_one_by_itself() -> None:
    """Of no energy, and of none at all, too."""
    arm, rng = problem().arm, np.random.default_rng(5)
    known = [
        MotionEnergy(e, Sensitivity(rng.normal(size=count(6)), 0.1), 1.5) for e in (50.0, 60.0, 0.0)
    ]
    others = [known[1], known[0], known[0]]
    alone = [saving_interval(*each, arm) for each in zip(others, known, strict=True)]
    for one, other in zip(saving_intervals(others, known, arm), alone, strict=True):
        # means over the draws, summed in another order
        assert [one.p5, one.p95, one.sd] == pytest.approx(
            [other.p5, other.p95, other.sd], rel=1e-12, abs=1e-12
        )
    assert saving_intervals([], [], arm) == []
