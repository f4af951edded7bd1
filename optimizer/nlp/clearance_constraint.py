"""Clearance as a limit along the path: every pair of bodies keeps its margin, and a hair more."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.robot import Array
from optimizer.collision.bodies import Indices
from optimizer.collision.model import CollisionModel, PairDistances
from optimizer.kinematics.path_constraints import ConstraintRatios

CLEARANCE = "clearance"
# kept beyond the margins [m]: twice the gap that the proof leaves between what it proves and what is met
RESERVE = 2e-4
# distance [m] over which a share falls from 1 to 0, and the distance from which on bodies do not count: as the solver
# does not look at shares below a half, only a bound is known of theirs
SCALE, COUNTED = 0.1, 0.06


@dataclass(frozen=True)
class ClearanceConstraint:
    """Pairs (k,) of a collision model. The share is 1 where a pair is RESERVE beyond its margin, 0 where it is SCALE
    further: linear in the signed distance.
    """

    model: CollisionModel
    pairs: Indices

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The same name for every pair."""
        return (CLEARANCE,) * len(self.pairs)

    def ratios(self, frames: Array, q: Array, v: Array) -> Array:
        """ConstraintRatios (n, k)."""
        return _share(self._pair_distances(frames).distance)

    def linearised(self, frames: Array, q: Array, v: Array) -> ConstraintRatios:
        """ConstraintRatios and gradients, which are zero for bodies further apart than counts."""
        found = self._pair_distances(frames)
        by_q = np.zeros((*found.distance.shape, q.shape[1]))
        gradients = self.model.gradients(frames, found.configuration, self.pairs[found.column], found.nearest)
        by_q[found.configuration, found.column] = gradients / -SCALE
        return ConstraintRatios(_share(found.distance), by_q, np.zeros_like(by_q))

    def _pair_distances(self, frames: Array) -> PairDistances:
        return self.model.pair_distances(frames, self.pairs, COUNTED)


def _share(distance: Array) -> Array:
    return np.asarray(1 - (distance - RESERVE) / SCALE)
