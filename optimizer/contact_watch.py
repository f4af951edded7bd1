"""What a given motion comes nearest to, by samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from optimizer.arm import Arm
from optimizer.collision import CollisionModel
from optimizer.pieces import Pieces

# between samples at most [s], if a block of pieces is not so long that it would take more than MOST
PERIOD, MOST = 0.01, 4096
# samples of a block that are looked at first
COARSE = 16


@dataclass(frozen=True)
class Nearest:
    """The least distance met [m], less the obstacle's margin, of which `pair` and when [s].

    Met at instants at most `spacing` [s] apart: between two of them the arm may come nearer.
    """

    distance: float
    pair: tuple[str, str]
    time: float
    spacing: float


class ContactWatch:
    """Sees a motion go by and keeps the least distance."""

    def __init__(self, arm: Arm) -> None:
        self._model = CollisionModel(arm)
        self.nearest: Nearest | None = None

    def see(self, pieces: Pieces) -> None:
        """Consecutive pieces."""
        begin, end = float(pieces.breaks[0]), float(pieces.breaks[-1])
        t = np.linspace(begin, end, min(int(np.ceil((end - begin) / PERIOD)), MOST) + 1)
        piece = np.clip(np.searchsorted(pieces.breaks, t, side="right") - 1, 0, len(pieces.segment) - 1)
        q = pieces.at(piece, t - pieces.breaks[piece])[0]
        known = self.nearest
        # most of the work is saved by what is far from everything: its bounding balls are enough then
        within = min((c.distance for c in self._model.contacts(q[:: max(len(q) // COARSE, 1)])), default=np.inf)
        contacts = self._model.contacts(q, within if known is None else min(within, known.distance))
        if not contacts:
            return
        spacing = max((end - begin) / (len(t) - 1), 0.0 if known is None else known.spacing)
        k = min(range(len(contacts)), key=lambda k: contacts[k].distance)
        if known is None or contacts[k].distance < known.distance:
            self.nearest = Nearest(contacts[k].distance, contacts[k].pair, float(t[k]), spacing)
        else:
            self.nearest = replace(known, spacing=spacing)
