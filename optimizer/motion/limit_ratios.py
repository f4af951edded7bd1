"""Values over limits: position, velocity, acceleration, jerk, torque."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array, Limits

RATIO_TOLERANCE = 1e-6
"""Excess over 1 up to which a ratio of value to limit counts as rounding, in certificates and in
all other checks of limits.
"""


def limit_ratios(
    limits: Limits, q: Array, v: Array, a: Array, jerk: Array, tau_limited: Array
) -> dict[str, float]:
    """Largest ratio of value to limit, over samples and joints of arrays (k, nq), by name of the
    limit; k may differ between the arrays.
    """
    return {
        name: float(each.max()) for name, each in ratios(limits, q, v, a, jerk, tau_limited).items()
    }


def excess_text(name: str, ratio: float) -> str:
    """Text on a broken limit, for a ratio of value to limit > 1."""
    words = name.replace("_", " ")
    return (
        f"{words} {(ratio - 1) * 100:.3g} % above its limit"
        if np.isfinite(ratio)
        else f"unbounded {words}"
    )


def ratios(
    limits: Limits, q: Array, v: Array, a: Array, jerk: Array, tau_limited: Array
) -> dict[str, Array]:
    """Ratios of value to limit (k, nq) of every sample and joint; k may differ between the arrays.

    The ratio of a position is its distance from the middle of the joint's range over half the
    range: 1 is on a limit, even for asymmetric limits.
    """
    middle, half = (limits.q_max + limits.q_min) / 2, (limits.q_max - limits.q_min) / 2
    return {
        "position": np.abs(q - middle) / half,
        "velocity": np.abs(v) / limits.v_max,
        "acceleration": np.abs(a) / limits.a_max,
        "jerk": np.abs(jerk) / limits.j_max,
        "torque": np.abs(tau_limited) / limits.tau_max,
    }
