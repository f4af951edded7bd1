"""Clearance as a path constraint: every constrained pair of bodies keeps its margin, and RESERVE beyond it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.robot import Array
from optimizer.collision.bodies import Indices
from optimizer.collision.model import CollisionModel, PairDistances
from optimizer.kinematics.path_constraints import ConstraintRatios

CLEARANCE = "clearance"
# distance kept beyond the margins [m]: twice the difference that the proof allows between proven and sampled clearance
RESERVE = 2e-4
# distance [m] over which a ratio falls from 1 to 0, and the distance above which only a bound of it is computed: the QP
# leaves out ratios below a half
SCALE, COUNTED = 0.1, 0.06


@dataclass(frozen=True)
class ClearanceConstraint:
    """Clearance of the pairs (k,) of a collision model.

    The ratio is linear in the signed distance: 1 at RESERVE beyond the margin, 0 at SCALE beyond that.
    """

    model: CollisionModel
    pairs: Indices

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The same name for every pair."""
        return (CLEARANCE,) * len(self.pairs)

    def ratios(self, frames: Array, q: Array, v: Array) -> Array:
        """Ratios (n, k)."""
        return _ratio(self._pair_distances(frames).distance)

    def linearised(self, frames: Array, q: Array, v: Array) -> ConstraintRatios:
        """Ratios with gradients, which are zero for pairs above the distance COUNTED."""
        found = self._pair_distances(frames)
        by_q = np.zeros((*found.distance.shape, q.shape[1]))
        gradients = self.model.gradients(frames, found.configuration, self.pairs[found.column], found.nearest)
        by_q[found.configuration, found.column] = gradients / -SCALE
        return ConstraintRatios(_ratio(found.distance), by_q, np.zeros_like(by_q))

    def _pair_distances(self, frames: Array) -> PairDistances:
        return self.model.pair_distances(frames, self.pairs, COUNTED)


def _ratio(distance: Array) -> Array:
    return np.asarray(1 - (distance - RESERVE) / SCALE)
