"""Clearance as a path constraint: every constrained pair of bodies keeps its margin and a
reserve.
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


@dataclass(frozen=True)
class ClearanceSettings:
    """Clearance as a ratio of a path constraint."""

    reserve: float = 2e-4
    """Distance kept beyond the margins [m]: twice the difference between proven and sampled
    clearance that the proof allows.
    """
    ratio_range: float = 0.1
    """Distance [m] over which the ratio decreases from 1 to 0."""
    gradient_distance: float = 0.06
    """Distance [m] above which only a bound is computed, without a gradient: the QP leaves out
    ratios below a half.
    """
    exact_ratio: float = 0.98
    """Ratio above which the ratios of a checked motion are exact [1]."""


CLEARANCE_CONSTRAINT = ClearanceSettings()


@dataclass
class _LastDistances:
    """Lower bounds on distances (n, p) [m] at the configurations q (n, nq) [rad] of the last call.

    They bound the distances at nearby configurations.
    """

    q: Array
    distance: Array

    def bounds(self, model: CollisionModel, q: Array, pairs: Indices) -> Array | None:
        """Lower bounds (n, p) [m] at q (n, nq) [rad]; None for another number of configurations."""
        if self.q.shape != q.shape:
            return None
        return self.distance - model.greatest_changes(q - self.q, pairs)

    def store(self, q: Array, distance: Array) -> None:
        """Replaces the distances of the last call."""
        self.q, self.distance = q, distance


@dataclass(frozen=True)
class ClearanceConstraint:
    """Clearance of the pairs (k,) of a collision model.

    The ratio is linear in the signed distance: 1 at `reserve` beyond the margin, 0 at `ratio_range`
    beyond that distance.
    """

    model: CollisionModel
    pairs: Indices

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of the constraint, once per pair."""
        return (CLEARANCE,) * len(self.pairs)

    def ratios(self, frames: Array, q: Array, v: Array) -> Array:
        """Ratios (n, k) at consecutive samples of a motion, exact above `exact_ratio`; all others
        are bounded by it.
        """
        settings = CLEARANCE_CONSTRAINT
        within = settings.reserve + (1 - settings.exact_ratio) * settings.ratio_range
        return _ratio(self.model.distances_along(q, within, self.pairs))

    def linearised(
        self, frames: Array, q: Array, v: Array, wanted: Mask | None = None
    ) -> ConstraintRatios:
        """Ratios with gradients; the gradient is zero for pairs beyond `gradient_distance`, and for
        pairs that are not `wanted`.
        """
        distances = (
            self._pair_distances(frames, q)
            if wanted is None
            else self.model.chosen_distances(frames, self.pairs, wanted)
        )
        by_q = np.zeros((*distances.distance.shape, q.shape[1]))
        gradients = self.model.gradients(
            frames, distances.configuration, self.pairs[distances.column], distances.nearest
        )
        exact = distances.configuration, distances.column
        by_q[exact] = gradients / -CLEARANCE_CONSTRAINT.ratio_range
        return ConstraintRatios(_ratio(distances.distance), by_q, np.broadcast_to(0.0, by_q.shape))

    def _pair_distances(self, frames: Array, q: Array) -> PairDistances:
        """Distances at q (n, nq), with bounds instead for pairs bounded away from
        `gradient_distance` by the distances of the last call.
        """
        bounds = self._last.bounds(self.model, q, self.pairs)
        distances = self.model.pair_distances(
            frames, self.pairs, CLEARANCE_CONSTRAINT.gradient_distance, bounds
        )
        self._last.store(q, distances.distance)
        return distances

    @cached_property
    def _last(self) -> _LastDistances:
        """Distances of the last call; empty at first."""
        return _LastDistances(np.zeros((0, self.model.nq)), np.zeros((0, len(self.pairs))))


def _ratio(distance: Array) -> Array:
    return np.asarray(
        1 - (distance - CLEARANCE_CONSTRAINT.reserve) / CLEARANCE_CONSTRAINT.ratio_range
    )
