"""Angles modulo full turns."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def wrapped(angle: Array) -> Array:
    """Angles [rad], shifted by full turns into [-π, π]."""
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def nearest_turn(angle: Array, reference: Array) -> Array:
    """Angles [rad], shifted by full turns to within half a turn of `reference` [rad]."""
    return angle + 2 * np.pi * np.rint((reference - angle) / (2 * np.pi))
