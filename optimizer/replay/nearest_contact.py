"""What a given motion comes nearest to, by samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from optimizer.collision.model import collision_model
from optimizer.problem.arm import Arm
from optimizer.replay.piecewise_motion import PiecewiseMotion

# between samples at most [s], if a block of pieces is not so long that it would take more than MOST
PERIOD, MOST = 0.01, 16384
# samples of a block that are looked at first
COARSE = 16
# pairs of bodies at instants that are looked at together
CHECKS = 100_000


@dataclass(frozen=True)
class LeastClearance:
    """The least distance met [m], less the obstacle's margin, of which `pair` and when [s].

    Met at instants at most `spacing` [s] apart: between two of them the arm may come nearer.
    """

    distance: float
    pair: tuple[str, str]
    time: float
    spacing: float


class ClearanceMonitor:
    """Sees a motion go by and keeps the least distance."""

    def __init__(self, arm: Arm) -> None:
        self._model = collision_model(arm)
        self.nearest: LeastClearance | None = None

    def update(self, pieces: PiecewiseMotion) -> None:
        """Consecutive pieces."""
        begin, end = float(pieces.breaks[0]), float(pieces.breaks[-1])
        t = np.linspace(begin, end, min(int(np.ceil((end - begin) / PERIOD)), MOST) + 1)
        piece = np.clip(np.searchsorted(pieces.breaks, t, side="right") - 1, 0, len(pieces.segment) - 1)
        q = pieces.at(piece, t - pieces.breaks[piece])[0]
        spacing = max((end - begin) / (len(t) - 1), 0.0 if self.nearest is None else self.nearest.spacing)
        # most of the work is saved by what is far from everything: its bounding balls are enough then
        within = min((c.distance for c in self._model.closest_pairs(q[:: max(len(q) // COARSE, 1)])), default=np.inf)
        at_once = max(CHECKS // max(len(self._model.pairs), 1), 1)
        for low in range(0, len(q), at_once):
            contacts = self._model.closest_pairs(q[low : low + at_once], within)
            for k, contact in enumerate(contacts, low):
                if self.nearest is None or contact.distance < self.nearest.distance:
                    self.nearest = LeastClearance(contact.distance, contact.pair, float(t[k]), spacing)
            within = within if self.nearest is None else min(within, self.nearest.distance)
        if self.nearest is not None:
            self.nearest = replace(self.nearest, spacing=spacing)
