"""Polynomials of waves, at whose zeros the self-motions of seven-joint arms may end: against their
values.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.seven.redundant_pose import (
    Polynomial,
    _angles,
    _product,
    _sum,
    _wave,
)


def test_polynomials_are_what_they_say() -> None:
    """Products and sums of waves against their values, and the angles at which a product is
    zero."""
    rng = np.random.default_rng(75)
    q = rng.uniform(-np.pi, np.pi, 9)

    def value(polynomial: Polynomial, at: Array) -> Array:
        powers = [coefficient * np.exp(1j * k * at) for k, coefficient in enumerate(polynomial)]
        return np.asarray(powers[0].real + 2 * sum(each.real for each in powers[1:]))

    (a, b, c), zeros = rng.normal(size=(3, 3)).tolist(), rng.uniform(-3.0, 3.0, 2)
    one, two, three = _wave(a[0], a[1], a[2]), _wave(*b), _wave(*c)
    assert np.abs(value(one, q) - (a[0] + a[1] * np.cos(q) + a[2] * np.sin(q))).max() < 1e-14
    product = _product(_product(one, two), _product(three, three))
    assert (
        np.abs(value(product, q) - value(one, q) * value(two, q) * value(three, q) ** 2).max()
        < 1e-12
    )
    total = _sum((2.0, one), (-0.5, product))
    assert np.abs(value(total, q) - 2 * value(one, q) + value(product, q) / 2).max() < 1e-12
    # cos(q - middle) - cos(half) is zero at both ends
    middle, half = zeros.mean(), np.ptp(zeros) / 2
    between = _wave(-np.cos(half), np.cos(middle), np.sin(middle))
    found = _angles(_product(between, _wave(2.0, 0.3, 0.4)))
    assert np.abs(np.sort(found) - np.sort(zeros)).max() < 1e-12
