"""Real trigonometric polynomials and their zeros."""

from __future__ import annotations

from math import atan2

import numpy as np

Polynomial = list[complex]
"""Coefficients of the powers 0, 1, … of exp(iq) in a real polynomial in exp(iq) and exp(-iq); those
of exp(-iq) are their conjugates. Lists of a few numbers are several times faster than arrays.
"""

ONE: Polynomial = [1 + 0j]

NEGLIGIBLE = 1e-14
"""Coefficient, relative to the largest, below which a leading coefficient is due to rounding."""

NEAR_CIRCLE = 1e-4
"""Distance from the unit circle within which a zero may be an angle."""


def sinusoid(a: float, b: float, c: float) -> Polynomial:
    """Polynomial a + b cos q + c sin q."""
    return [complex(a), complex(b, -c) / 2]


def weighted_sum(*terms: tuple[float, Polynomial]) -> Polynomial:
    """Linear combination of polynomials, given as pairs of factor and polynomial."""
    total = [0j] * max(len(each) for _, each in terms)
    for factor, each in terms:
        for k, coefficient in enumerate(each):
            total[k] += factor * coefficient
    return total


def product(p: Polynomial, r: Polynomial) -> Polynomial:
    """Product of two polynomials."""
    total = [0j] * (len(p) + len(r) - 1)
    for k, a in enumerate(p):
        for j, b in enumerate(r):
            total[k + j] += a * b
            # the product with the conjugate power: only non-negative powers are stored
            if k and j:
                other = a * b.conjugate() if k >= j else a.conjugate() * b
                total[abs(k - j)] += other if k != j else 2 * other.real
    return total


def zero_angles(polynomial: Polynomial) -> list[float]:
    """Find the zeros of a polynomial by the eigenvalues of its companion matrix.

    Returns:
        Angles q of zeros and near zeros [rad]; empty for a constant polynomial.
    """
    size = [abs(each) for each in polynomial]
    least, degree = NEGLIGIBLE * max(size), len(size) - 1
    while degree and size[degree] <= least:
        degree -= 1
    if not degree:
        return []
    # Falling powers; the eigenvalues of the companion matrix are the zeros.
    falling = [*polynomial[degree:0:-1], *(each.conjugate() for each in polynomial[: degree + 1])]
    companion = np.eye(2 * degree, k=-1, dtype=complex)
    companion[0] = [-each / falling[0] for each in falling[1:]]
    return [
        atan2(root.imag, root.real)
        for root in np.linalg.eigvals(companion).tolist()
        if abs(abs(root) - 1) < NEAR_CIRCLE
    ]
