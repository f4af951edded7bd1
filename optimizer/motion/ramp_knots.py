"""Knots of slow motions, with short ramps relative to their duration.

Evenly spaced knots cannot follow a ramp much shorter than their distance, and the motion would take
longer by a large part of this distance. So a slow motion has knots at the ramps of its leading
coordinate, and spans that grow from there. Knots for one duration also suit similar durations:
short spans next to the ends serve the starts and stops of the other joints, too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE, Basis, clamped, graded
from joulepath.optimizer.motion.spline import Spline


@dataclass(frozen=True)
class RampKnots:
    """Motions with knots at their ramps, and the positions of these knots."""

    slow_below: float = 0.05
    """Ratio of ramp to duration below which a motion is slow [1]. At 0.05, thirteen control points
    with evenly spaced knots cost 0.3 % of the energy of a UR5e, at 0.02 1 %. At the speed limits of
    most arms the ratio is above 0.1, and evenly spaced knots cost next to nothing.
    """
    growth: float = 3.0
    """Greatest ratio of neighbouring spans [1]. With 3, a first solve is 0.3 % above its
    refinement; with 2, it takes longer and its refinement is no better.
    """
    widest_refined_span: float = 1 / 32
    """Greatest span of a refinement, as a fraction of the duration [1]. In motions of a minute with
    joints that start and stop far from the ends, twice the width costs up to 0.8 % of the energy;
    half the width gains at most 0.1 %.
    """
    shortest_end_span: float = 1e-4
    """Least distance of a knot from an end, as a fraction of the duration [1]. Shorter ramps are
    lengthened to it, at a cost of at most 0.01 % of the time; the third derivative there stays well
    within double precision.
    """
    closest_switches: float = 2e-5
    """Distance of two switches of jerk, as a fraction of the duration, below which they count as
    one [1].
    """
    smallest_displacement: float = 0.02
    """Displacement [rad] for the ramps of a motion between equal configurations. In a long duration
    such a motion goes to a configuration with less holding power and back, in some tenths of a
    second.
    """
    largest_path_ratio: float = 0.9
    """Greatest ratio of a path constraint in the time-optimal motion of a slow motion [1]. Above
    it, the constraint will be active, such as a speed limit of the TCP that is tighter than the
    joints' limits.
    """

    def is_slow(self, ramp: float, duration: float) -> bool:
        """Whether a motion of `duration` [s] is slow, with ramps of `ramp` [s] at the limits."""
        return ramp < self.slow_below * duration

    def has_ramp_knots(self, spline: Spline) -> bool:
        """Whether a motion has the knots of a slow motion's first solve: of multiplicity one and
        unevenly spaced, with some spans wider than in a refinement.
        """
        spans = np.diff(spline.knots[DEGREE:-DEGREE]) / spline.duration
        return bool(
            spans.max() > max(self.widest_refined_span, 1.001 * spans.min()) and spans.min() > 0
        )

    def space(self, switches: Array, repeat: int, count: int) -> Basis:
        """Space with knots of multiplicity `repeat` at the switches (k,) in [0, 1].

        The widest spans are as wide as the spans of `count` control points with evenly spaced
        knots.
        """
        knots = np.unique(np.clip(switches, self.shortest_end_span, 1 - self.shortest_end_span))
        return graded(knots, repeat, 1 / (count - DEGREE), self.growth, next_to_end=0.0)

    def refined(self, knots: Array, switches: Array, repeat: int) -> Basis:
        """Space that contains the space of `knots`.

        The knots nearest to the switches (k,) have multiplicity `repeat`, and no span is wider than
        `widest_refined_span`.
        """
        breaks = np.unique(knots)
        counts = np.ones(len(breaks), dtype=int)
        counts[np.abs(breaks[1:-1, None] - switches).argmin(axis=0) + 1] = repeat
        between = [
            np.linspace(a, b, math.ceil((b - a) / self.widest_refined_span) + 1)[1:-1]
            for a, b in pairwise(breaks)
        ]
        return Basis.of(clamped(np.sort(np.concatenate([np.repeat(breaks, counts), *between]))))
