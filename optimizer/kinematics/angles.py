"""Angles that differ by full turns."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def wrapped(angle: Array) -> Array:
    """The angles [rad] less the full turns that bring them into [-π, π]."""
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def nearest_turn(angle: Array, reference: Array) -> Array:
    """The angles [rad] with the full turns that bring them within half a turn of `reference`
    [rad]."""
    return angle + 2 * np.pi * np.rint((reference - angle) / (2 * np.pi))
