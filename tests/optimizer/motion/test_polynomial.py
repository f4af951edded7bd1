"""Polynomials by their values at Chebyshev nodes, and the quintic from rest to rest, against NumPy
and Bernstein's form.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.motion.polynomial import cardinals, chebyshev, polynomials
from joulepath.optimizer.motion.quintic import PEAKS, coefficients, derivatives, fraction
from joulepath.optimizer.motion.spline import peak_rates, sample, spline_of

COUNTS = [1, 4, 8, 10, 12]
# Bernstein's coefficients of degree 17 reach 5e3 times the values: five digits of sixteen are lost
EXACT = 1e-10
# of the central differences: their error is its square times the third derivative, some 1e4
STEP = 1e-5
DIFFERENCES = 1e-4  # relative


def by_products(m: int, at: Array) -> Array:
    """Cardinal functions of the inner nodes by the product formula, (k, m)."""
    x = chebyshev(m)
    ends = (at * (1 - at)) ** 3
    return np.stack(
        [
            ends
            / (x[i] * (1 - x[i])) ** 3
            * np.prod([(at - x[j]) / (x[i] - x[j]) for j in range(m) if j != i], axis=0)
            for i in range(m)
        ],
        axis=1,
    )


@pytest.mark.parametrize("m", COUNTS)
def test_cardinal_functions_are_products(m: int) -> None:
    space, at = polynomials(m), np.linspace(0.0, 1.0, 311)
    values = cardinals(space.knots, space.bernstein, at)
    assert values[:, 1:-1] == pytest.approx(by_products(m, at), abs=EXACT)
    assert values.sum(axis=1) == pytest.approx(1.0, abs=EXACT)


@pytest.mark.parametrize("m", COUNTS)
@pytest.mark.parametrize("derivative", [1, 2, 3])
def test_derivatives_against_differences(m: int, derivative: int) -> None:
    space, at = polynomials(m), np.linspace(0.01, 0.99, 53)
    found = cardinals(space.knots, space.bernstein, at, derivative)
    below, above = (
        cardinals(space.knots, space.bernstein, at + h, derivative - 1) for h in (-STEP, STEP)
    )
    assert np.abs((above - below) / (2 * STEP) - found).max() < DIFFERENCES * np.abs(found).max()


def test_nodes_are_those_of_chebyshev() -> None:
    """Extremes of the Chebyshev polynomial of degree m + 5, without the outer three at either
    end."""
    m = 9
    extremes = np.polynomial.chebyshev.Chebyshev.basis(m + 5).deriv().roots()
    assert chebyshev(m) == pytest.approx((1 + np.sort(extremes)[2:-2]) / 2, abs=1e-12)


@pytest.mark.parametrize("m", COUNTS)
def test_a_motion_is_its_polynomial_and_rests_at_both_ends(m: int) -> None:
    rng, space = np.random.default_rng(m), polynomials(m)
    points = rng.uniform(-3, 3, (m + 2, 6))
    motion = spline_of(space, points, 1.7)
    assert motion.degree == m + 5 and len(motion.control_points) == m + 6
    q, v, a = sample(motion, np.linspace(0.0, 1.7, 401))
    both = cardinals(space.knots, space.bernstein, np.linspace(0.0, 1.0, 401))
    assert q == pytest.approx(both @ points, abs=EXACT)
    for rate in (v, a):
        assert np.abs(rate[[0, -1]]).max() == 0


@pytest.mark.parametrize("m", COUNTS)
def test_fit_gives_a_polynomial_back(m: int) -> None:
    rng, space = np.random.default_rng(m), polynomials(m)
    points, at = rng.uniform(-3, 3, (m + 2, 3)), np.linspace(0.0, 1.0, 97)
    samples = cardinals(space.knots, space.bernstein, at) @ points
    assert space.fit(samples, at) == pytest.approx(points, abs=EXACT)


def test_the_quintic_is_among_them() -> None:
    space, at = polynomials(10), np.linspace(0.0, 1.0, 201)
    law = at**3 * (10 - 15 * at + 6 * at**2)
    points = space.fit(law[:, None], at)
    assert spline_of(space, points, 1.0).control_points[:, 0] == pytest.approx(
        bernstein_of_quintic(15), abs=EXACT
    )


def bernstein_of_quintic(degree: int) -> Array:
    """Coefficients of the rest-to-rest quintic after raising its degree from five."""
    points = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    for n in range(5, degree):
        share = np.arange(n + 2) / (n + 1)
        points = share * np.append(0.0, points)[: n + 2] + (1 - share) * np.append(points, 0.0)
    return points


@pytest.mark.parametrize("m", COUNTS)
def test_peaks_of_a_high_degree(m: int) -> None:
    """Peaks are never below samples a hundred times finer, and hardly above them."""
    rng, space = np.random.default_rng(7 * m), polynomials(m)
    motion = spline_of(space, rng.uniform(-1, 1, (m + 2, 4)), 0.9)
    curve = BSpline(motion.knots, motion.control_points, motion.degree)
    t = np.linspace(0.0, 0.9, 40001)
    fine = np.stack([np.abs(curve(t, d)).max(axis=0) for d in (1, 2, 3)])
    assert peak_rates(motion) == pytest.approx(fine, rel=1e-4)


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


def test_peaks() -> None:
    dense = np.linspace(0.0, 1.0, 10_001)
    found = [np.abs(S.deriv(k)(dense)).max() for k in (1, 2, 3)]
    assert np.array(found) == pytest.approx(PEAKS, rel=BETWEEN)


def test_coefficients_are_those_of_the_time() -> None:
    durations = np.array([0.5, 2.0])
    for k, T in enumerate(durations):
        powers = [c[k] for c in coefficients(durations)]
        assert np.polyval(powers, TAU * T) == pytest.approx(S(TAU), abs=ROUNDING)
