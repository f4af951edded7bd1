"""Clearance as a path constraint: every constrained pair of bodies keeps its margin, and RESERVE
beyond it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.model import CollisionModel, PairDistances
from joulepath.optimizer.kinematics.path_constraints import ConstraintRatios

CLEARANCE = "clearance"
# distance kept beyond the margins [m]: twice the difference that the proof allows between proven
# and sampled clearance
RESERVE = 2e-4
# distance [m] over which a ratio falls from 1 to 0, and the distance above which only a bound of it
# is computed: the QP leaves out ratios below a half
SCALE, COUNTED = 0.1, 0.06
# the ratio above which that of a motion that is checked is exact
CHECKED = 0.98


@dataclass
class _Known:
    """Lower bounds on distances (n, p) [m] at configurations q (n, nq) [rad], from which those
    nearby are bounded.
    """

    q: Array
    distance: Array


@dataclass(frozen=True)
class ClearanceConstraint:
    """Clearance of the pairs (k,) of a collision model.

    The ratio is linear in the signed distance: 1 at RESERVE beyond the margin, 0 at SCALE beyond
    that.
    """

    model: CollisionModel
    pairs: Indices

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The same name for every pair."""
        return (CLEARANCE,) * len(self.pairs)

    def ratios(self, frames: Array, q: Array, v: Array) -> Array:
        """Ratios (n, k) at consecutive samples of a motion, exact above CHECKED; the others are
        below it.
        """
        return _ratio(self.model.along(q, RESERVE + (1 - CHECKED) * SCALE, self.pairs))

    def linearised(
        self, frames: Array, q: Array, v: Array, wanted: Mask | None = None
    ) -> ConstraintRatios:
        """Ratios with gradients, which are zero for pairs above the distance COUNTED, and for those
        not `wanted`.
        """
        found = (
            self._pair_distances(frames, q)
            if wanted is None
            else self.model.chosen_distances(frames, self.pairs, wanted)
        )
        by_q = np.zeros((*found.distance.shape, q.shape[1]))
        gradients = self.model.gradients(
            frames, found.configuration, self.pairs[found.column], found.nearest
        )
        by_q[found.configuration, found.column] = gradients / -SCALE
        return ConstraintRatios(_ratio(found.distance), by_q, np.broadcast_to(0.0, by_q.shape))

    def _pair_distances(self, frames: Array, q: Array) -> PairDistances:
        """Distances at q (n, nq), of which those bounded away from COUNTED by earlier ones are not
        computed.
        """
        last, known = self._last, None
        if last.q.shape == q.shape:
            known = last.distance - self.model.changes(q - last.q, self.pairs)
        found = self.model.pair_distances(frames, self.pairs, COUNTED, known)
        last.q, last.distance = q, found.distance
        return found

    @cached_property
    def _last(self) -> _Known:
        """What was computed last: nothing at first."""
        return _Known(np.zeros((0, self.model.nq)), np.zeros((0, len(self.pairs))))


def _ratio(distance: Array) -> Array:
    return np.asarray(1 - (distance - RESERVE) / SCALE)
