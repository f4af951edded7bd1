"""Checks of pairs of bodies over intervals of time, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.rows import Rows
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.pair_distance import WitnessPoints


@dataclass(frozen=True)
class Instants(Rows):
    """Times t (k,) [s] of a motion, and the link frames at these times (k, nq + 1, 4, 4)."""

    t: Array
    frames: Array


@dataclass(frozen=True)
class IntervalChecks(Rows):
    """Pairs over intervals (k,), with their distances at both ends.

    `pair` are indices of pairs, `begin` and `end` indices of instants. `part` is the part of the
    first body if this is a patch of a cloud, or -1 for all of its parts.
    """

    pair: Indices
    part: Indices
    begin: Indices
    end: Indices
    at_begin: WitnessPoints
    at_end: WitnessPoints

    def distinct_intervals(self) -> tuple[Indices, Indices]:
        """The distinct intervals (m, 2), as indices of instants, and the interval of every check
        (k,) among them.
        """
        # Encoded as one number each, since sorting rows of two is much slower.
        base = int(self.end.max(initial=0)) + 1
        codes, interval = np.unique(self.begin * base + self.end, return_inverse=True)
        return np.column_stack(np.divmod(codes, base)), interval
