"""Ends of the intervals of the last angle over which a pose of a `SphericalShoulder` has
configurations: zeros of real trigonometric polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan2, hypot, remainder, tau

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.seven.spherical_shoulder import SphericalShoulder


@dataclass(frozen=True)
class EdgeSettings:
    """Tolerances of the ends of intervals."""

    apart: float = 1e-9
    """Distance of two edges below which they are one [rad]."""
    negligible: float = 1e-14
    """Amplitude of cos θ over q7, relative to the largest, below which θ is constant."""
    constant: float = 1e-12
    """Coefficient of sin θ in c [m] below which c depends on cos θ alone."""


SETTINGS = EdgeSettings()


def interval_edges(form: SphericalShoulder, coefficients: Array) -> Array:
    """Angles of q7 that may end an interval of any branch.

    Args:
        form: form of the arm.
        coefficients: coefficients (2, 3) of 1, cos q7 and sin q7 in |v|² [m²] and v_z [m].

    Returns:
        The sorted angles (k,) [rad] in [-π, π).
    """
    square, height = coefficients.tolist()
    scale = 2 * form.rho * form.nu
    cos = sinusoid((form.squares - square[0]) / scale, -square[1] / scale, -square[2] / scale)
    v_z, d2 = sinusoid(*height), sinusoid(*square)
    k0, kc, ks = form.along_fifth
    flat = weighted_sum((kc, cos), (-float(form.fifth_in_6[2]), v_z), (k0, ONE))
    sin2, flat2 = weighted_sum((1.0, ONE), (-1.0, product(cos, cos))), product(flat, flat)
    incline = form.inclined**2
    P = weighted_sum((incline, d2), (-incline, product(v_z, v_z)), (-1.0, flat2), (-(ks**2), sin2))
    if abs(ks) > SETTINGS.constant:
        P = weighted_sum((1.0, product(P, P)), (-4 * ks**2, product(flat2, sin2)))
    found = sorted([*zero_angles(P), *_straight_elbow_angles(form, square)])
    return np.array(
        [each for k, each in enumerate(found) if k == 0 or each - found[k - 1] > SETTINGS.apart]
    )


def _straight_elbow_angles(form: SphericalShoulder, square: list[float]) -> list[float]:
    """Angles of q7 [rad] with a stretched or folded elbow, |cos θ| = 1, or nearly so."""
    still, ahead, aside = square
    reach = 2 * form.rho * form.nu
    size = hypot(ahead, aside)
    phase = atan2(aside, ahead)
    if size <= SETTINGS.negligible * reach:
        return []
    cosines = [(form.squares - still + each) / size for each in (reach, -reach)]
    turned = [
        acos(min(max(each, -1.0), 1.0)) for each in cosines if abs(each) < 1 + NEAR_CIRCLE**2 / 2
    ]
    return [remainder(phase + side * each, tau) for side in (1.0, -1.0) for each in turned]


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
