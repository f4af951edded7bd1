"""A motion replayed by Pinocchio and Coal: how many of its samples are in collision."""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.planner.state_validity import StateValidityChecker
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.problem.arm import Arm


def collisions(arm: Arm, spline: Spline, period: float) -> int:
    """Samples of a motion in collision, one every `period` [s] and the last."""
    checker = StateValidityChecker(arm, CollisionModel(arm))
    t = np.append(np.arange(0.0, spline.duration, period), spline.duration)
    return sum(not checker.is_valid(q) for q in sample(spline, t)[0])
