"""The rest-to-rest quintic against NumPy's polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from joulepath.optimizer.motion.quintic import PEAKS, coefficients, derivatives, fraction

S = Polynomial([0, 0, 0, 10, -15, 6])
TAU = np.linspace(0.0, 1.0, 101)
# rounding of a few operations on numbers up to 60
ROUNDING = 1e-12
# relative; a peak between two of 10001 points: its curvature, at most 360, times (half their
# distance)², halved
BETWEEN = 1e-6


def test_values_and_derivatives() -> None:
    assert fraction(TAU) == pytest.approx(S(TAU), abs=ROUNDING)
    assert derivatives(TAU) == pytest.approx(
        np.array([S.deriv(k)(TAU) if k else S(TAU) for k in range(3)]), abs=ROUNDING
    )


def test_it_runs_from_rest_to_rest() -> None:
    assert derivatives(np.array([0.0, 1.0])).tolist() == [[0, 1], [0, 0], [0, 0]]


def test_peaks() -> None:
    dense = np.linspace(0.0, 1.0, 10_001)
    found = [np.abs(S.deriv(k)(dense)).max() for k in (1, 2, 3)]
    assert np.array(found) == pytest.approx(PEAKS, rel=BETWEEN)


def test_coefficients_are_those_of_the_time() -> None:
    durations = np.array([0.5, 2.0])
    for k, T in enumerate(durations):
        powers = [c[k] for c in coefficients(durations)]
        assert np.polyval(powers, TAU * T) == pytest.approx(S(TAU), abs=ROUNDING)
