"""Limits of an excitation as smooth penalties with gradients: each excess of a ratio over 1 costs
its square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.problem.arm import Arm

# share of a limit that the penalty begins at: it gives way a little
_KEPT = 0.97
# clearance [m] beyond the one asked for at which the penalty begins, and over which it grows to one
_RESERVE, _SCALE = 0.012, 0.02


def excess(values: Array, most: Array) -> tuple[float, Array]:
    """Σ (|x| / most − kept)₊² of values (n, nq), and its gradient."""
    over = np.maximum(np.abs(values) / most - _KEPT, 0.0)
    return float((over**2).sum()), 2 * over * np.sign(values) / most


def range_excess(arm: Arm, q: Array) -> tuple[float, Array]:
    """The same for joint positions q (n, nq) [rad] in their range."""
    limits = arm.active_limits
    middle, half = (limits.q_max + limits.q_min) / 2, (limits.q_max - limits.q_min) / 2
    return excess(q - middle, half)


def torque_excess(arm: Arm, tau: Array, v: Array, a: Array) -> tuple[float, Array]:
    """The same for torques tau (n, nq) [N·m] without friction; friction is taken as constant."""
    return excess(limited_torque(arm, tau, v, a), arm.active_limits.tau_max)


@dataclass(frozen=True)
class ClearancePenalty:
    """Penalty of samples closer than `clearance` [m] to an obstacle or the arm itself, margins
    subtracted.
    """

    model: CollisionModel
    clearance: float

    def __call__(self, q: Array) -> tuple[float, Array]:
        """Penalty of q (n, nq) [rad], and its gradient."""
        begin = self.clearance + _RESERVE
        distance, gradient = self.model.signed_distances(q, within=begin)
        over = np.maximum((begin - distance) / _SCALE, 0.0)
        return float((over**2).sum()), np.einsum("np,npj->nj", -2 * over / _SCALE, gradient)
