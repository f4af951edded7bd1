"""Trigonometric polynomials, compared with their values."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.seven.interval_edges import (
    Polynomial,
    product,
    sinusoid,
    weighted_sum,
    zero_angles,
)


def test_products_sums_and_zeros_of_sinusoids() -> None:
    """Products and sums of sinusoids against their values, and the zeros of a product."""
    rng = np.random.default_rng(75)
    q = rng.uniform(-np.pi, np.pi, 9)

    def value(polynomial: Polynomial, at: Array) -> Array:
        powers = [coefficient * np.exp(1j * k * at) for k, coefficient in enumerate(polynomial)]
        return np.asarray(powers[0].real + 2 * sum(each.real for each in powers[1:]))

    (a, b, c), zeros = rng.normal(size=(3, 3)).tolist(), rng.uniform(-3.0, 3.0, 2)
    one, two, three = sinusoid(a[0], a[1], a[2]), sinusoid(*b), sinusoid(*c)
    assert np.abs(value(one, q) - (a[0] + a[1] * np.cos(q) + a[2] * np.sin(q))).max() < 1e-14
    combined = product(product(one, two), product(three, three))
    assert (
        np.abs(value(combined, q) - value(one, q) * value(two, q) * value(three, q) ** 2).max()
        < 1e-12
    )
    total = weighted_sum((2.0, one), (-0.5, combined))
    assert np.abs(value(total, q) - 2 * value(one, q) + value(combined, q) / 2).max() < 1e-12
    # cos(q - middle) - cos(half) is zero at both ends
    middle, half = zeros.mean(), np.ptp(zeros) / 2
    between = sinusoid(-np.cos(half), np.cos(middle), np.sin(middle))
    found = zero_angles(product(between, sinusoid(2.0, 0.3, 0.4)))
    assert np.abs(np.sort(found) - np.sort(zeros)).max() < 1e-12
