"""Clearance as a limit along the path: every pair of bodies keeps its margin, and a hair more."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.robot import Array
from optimizer.collision import CollisionModel, Indices
from optimizer.path_limits import Shares

CLEARANCE = "clearance"
# kept beyond the margins [m]: twice the gap that the proof leaves between what it proves and what is met
RESERVE = 2e-4
# distance [m] over which a share falls from 1 to 0; bodies further apart than that do not count
SCALE = 0.1


@dataclass(frozen=True)
class KeepAway:
    """Pairs (k,) of a collision model. The share is 1 where a pair is RESERVE beyond its margin, 0 where it is SCALE
    further: linear in the signed distance.
    """

    model: CollisionModel
    pairs: Indices

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The same name for every pair."""
        return (CLEARANCE,) * len(self.pairs)

    def shares(self, frames: Array, q: Array, v: Array) -> Array:
        """Shares (n, k)."""
        return _share(self.model.nearest(frames, *self._every(len(q)), RESERVE + SCALE).distance).reshape(len(q), -1)

    def linearised(self, frames: Array, q: Array, v: Array) -> Shares:
        """Shares and gradients."""
        configuration, pair = self._every(len(q))
        found = self.model.nearest(frames, configuration, pair, RESERVE + SCALE)
        by_q = self.model.gradients(frames, configuration, pair, found).reshape(len(q), -1, q.shape[1]) / -SCALE
        return Shares(_share(found.distance).reshape(len(q), -1), by_q, np.zeros_like(by_q))

    def _every(self, count: int) -> tuple[Indices, Indices]:
        """Every pair at every configuration."""
        return np.repeat(np.arange(count), len(self.pairs)), np.tile(self.pairs, count)


def _share(distance: Array) -> Array:
    return np.asarray(1 - (distance - RESERVE) / SCALE)
