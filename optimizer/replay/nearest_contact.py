"""The least clearance of a given motion, by samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.robot import Array
from optimizer.collision.model import collision_model
from optimizer.deadline import checkpoint
from optimizer.problem.arm import Arm
from optimizer.replay.piecewise_motion import PiecewiseMotion

# greatest time between samples [s], unless a block would have more than MOST_INTERVALS of them
PERIOD, MOST_INTERVALS = 0.01, 16384
# samples of a block that are checked first, with exact distances of every pair
COARSE = 16
# pairs times configurations that are checked at once
CHECKS = 100_000


@dataclass(frozen=True)
class LeastClearance:
    """The least sampled distance [m] less the margin of the obstacle, between the bodies of `pair` at `time` [s].

    Samples are at most `spacing` [s] apart: between two of them the distance may be smaller.
    """

    distance: float
    pair: tuple[str, str]
    time: float
    spacing: float


class ClearanceMonitor:
    """Updates the least clearance of a motion, block after block. `nearest` is None if no pair is checked."""

    def __init__(self, arm: Arm) -> None:
        self._model = collision_model(arm)
        self.nearest: LeastClearance | None = None

    def update(self, motion: PiecewiseMotion) -> None:
        """Add the next block."""
        begin, end = float(motion.breakpoints[0]), float(motion.breakpoints[-1])
        t = np.linspace(begin, end, min(int(np.ceil((end - begin) / PERIOD)), MOST_INTERVALS) + 1)
        spacing = max((end - begin) / (len(t) - 1), 0.0 if self.nearest is None else self.nearest.spacing)
        self._add(t, motion.at_times(t)[0], spacing)
        if self.nearest is not None:
            self.nearest = replace(self.nearest, spacing=spacing)

    def _add(self, t: Array, q: Array, spacing: float) -> None:
        """Check samples q (k, nq) [rad] at times t (k,) [s]."""
        # for bodies farther apart than the least distance known, the distance of their enclosing balls is enough
        coarse = self._model.closest_pairs(q[:: max(len(q) // COARSE, 1)])
        within = min((closest.distance for closest in coarse), default=np.inf)
        at_once = max(CHECKS // max(len(self._model.pairs), 1), 1)
        for low in range(0, len(q), at_once):
            if low:
                checkpoint()
            for k, closest in enumerate(self._model.closest_pairs(q[low : low + at_once], within), low):
                if self.nearest is None or closest.distance < self.nearest.distance:
                    self.nearest = LeastClearance(closest.distance, closest.pair, float(t[k]), spacing)
            within = within if self.nearest is None else min(within, self.nearest.distance)
