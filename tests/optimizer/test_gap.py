"""The gap between an energy and the least possible one."""

from __future__ import annotations

import re

import numpy as np
import pytest

from joulepath.optimizer.presentation.gap import gap_text, optimality_gap

# relative
ROUNDING = 1e-12
# share of a unit of the last printed digit
DIGIT = 1e-3


def test_an_energy_is_at_most_its_gap_above_every_energy_beyond_the_bound() -> None:
    rng = np.random.default_rng(5)
    bound, above, other = rng.uniform(0.01, 100.0, (3, 200))
    for lower, energy, least in zip(bound, bound + above, bound + other, strict=True):
        gap = optimality_gap(lower, energy)
        assert gap is not None and energy <= (1 + gap) * least * (1 + ROUNDING)


@pytest.mark.parametrize("bound", [0.0, -3.0])
def test_a_bound_that_is_not_positive_gives_no_gap(bound: float) -> None:
    assert optimality_gap(bound, 5.0) is None
    assert gap_text(None) == "no positive lower bound"


def test_texts_round_up_but_not_exact_digits() -> None:
    assert gap_text(0.2) == "at most 20.0% above the least possible"
    assert gap_text(optimality_gap(50.0, 50.0)) == "at most 0.0% above the least possible"
    for gap in np.random.default_rng(6).uniform(0.0, 3.0, 200).tolist():
        stated = re.match(r"at most ([\d.]+)%", gap_text(gap))
        assert stated
        assert -ROUNDING <= float(stated[1]) / 100 - gap < DIGIT
