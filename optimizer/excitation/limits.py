"""Limits of an excitation as smooth penalties, with gradients.

A ratio of value to limit costs the square of its excess over a threshold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class PenaltySettings:
    """Thresholds of the penalties."""

    ratio_threshold: float = 0.97
    """Ratio of value to limit at which the penalty begins; a penalty yields a little [1]."""
    clearance_reserve: float = 0.012
    """Distance beyond the required clearance at which the penalty begins [m]."""
    clearance_scale: float = 0.02
    """Distance over which the penalty grows to one [m]."""


PENALTIES = PenaltySettings()


def excess(values: Array, most: Array) -> tuple[float, Array]:
    """Penalty Σ (|x| / most − threshold)₊² of values (n, nq), and its gradient (n, nq)."""
    over = np.maximum(np.abs(values) / most - PENALTIES.ratio_threshold, 0.0)
    return float((over**2).sum()), 2 * over * np.sign(values) / most


def range_excess(arm: Arm, q: Array) -> tuple[float, Array]:
    """Penalty of joint positions (n, nq) [rad] near the ends of their range, and its gradient."""
    limits = arm.active_limits
    middle, half = (limits.q_max + limits.q_min) / 2, (limits.q_max - limits.q_min) / 2
    return excess(q - middle, half)


def torque_excess(arm: Arm, tau: Array, v: Array, a: Array) -> tuple[float, Array]:
    """Penalty of torques tau (n, nq) [N·m] without friction, and its gradient at constant
    friction."""
    return excess(limited_torque(arm, tau, v, a), arm.active_limits.tau_max)


@dataclass(frozen=True)
class ClearancePenalty:
    """Penalty of samples closer to an obstacle or the arm itself than a clearance."""

    model: CollisionModel
    clearance: float
    """Smallest distance, margins subtracted [m]."""

    def __call__(self, q: Array) -> tuple[float, Array]:
        """Penalty of positions (n, nq) [rad], and its gradient (n, nq)."""
        begin = self.clearance + PENALTIES.clearance_reserve
        distance, gradient = self.model.signed_distances(q, within=begin)
        scale = PENALTIES.clearance_scale
        over = np.maximum((begin - distance) / scale, 0.0)
        return float((over**2).sum()), np.einsum("np,npj->nj", -2 * over / scale, gradient)
