"""Ends of the intervals of the last angle over which a pose of a `SphericalShoulder` has
configurations.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan2, hypot, remainder, tau

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.seven.spherical_shoulder import SphericalShoulder
from joulepath.optimizer.kinematics.seven.trigonometric_polynomials import (
    NEAR_CIRCLE,
    ONE,
    product,
    sinusoid,
    weighted_sum,
    zero_angles,
)


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
