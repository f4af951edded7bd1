"""Knots of slow motions, whose ramps are short beside their duration.

Evenly spaced knots cannot follow a ramp that is much shorter than their distance: the motion would
take longer by a good part of it. So a slow motion has knots at the ramps of its leading coordinate,
and spans that grow from there: any duration near the first one has short spans next to its ends,
too, where the other joints start and stop.
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
    """Which motions have knots at their ramps, and how these lie.

    `slow_below` [1]: the ratio of ramp to duration below which a motion is slow. At 0.05, thirteen
    control points with evenly spaced knots cost 0.3 % of the energy of a UR5e, at 0.02 1 %; at the
    limits of speed of most arms it is above 0.1, where they cost next to nothing.

    `growth` [1]: the greatest ratio of neighbouring spans. With 3, a first solve is 0.3 % above its
    refinement; with 2, it takes longer, and its refinement is no better.

    `refined_widest` [1]: the width of the widest span of a refinement. In motions of a minute,
    twice the width costs up to 0.8 % of the energy, in which other joints start and stop far from
    the ends; half of it gains 0.1 % at most.

    `finest` [1]: the least distance between a knot and an end, as a fraction of the duration.
    Shorter ramps count as that long, which costs at most 0.01 % of the time; the third derivative
    there stays well within double precision.

    `closest` [1]: switches of jerk nearer to each other than this fraction of the duration count as
    one.

    `least_way` [rad]: the displacement whose ramps count where start and goal are the same. In a
    long duration such a motion goes to where holding costs less, and back: that needs some tenths
    of a second.

    `most_held_back` [1]: the greatest ratio of a path constraint in the time-optimal motion of a
    slow one. Above it, such a constraint will be active, as that of a TCP that is slower than the
    joints.
    """

    slow_below: float = 0.05
    growth: float = 3.0
    refined_widest: float = 1 / 32
    finest: float = 1e-4
    closest: float = 2e-5
    least_way: float = 0.02
    most_held_back: float = 0.9

    def is_slow(self, ramp: float, duration: float) -> bool:
        """Whether a motion of `duration` [s] is slow, whose ramps last `ramp` [s] at the limits."""
        return ramp < self.slow_below * duration

    def are_in(self, spline: Spline) -> bool:
        """Whether a motion has the knots of a slow motion's first solve: single ones, at uneven
        distances, some of them farther apart than those of a refinement."""
        spans = np.diff(spline.knots[DEGREE:-DEGREE]) / spline.duration
        return bool(spans.max() > max(self.refined_widest, 1.001 * spans.min()) and spans.min() > 0)

    def space(self, switches: Array, repeat: int, count: int) -> Basis:
        """A space with knots of multiplicity `repeat` at the switches (k,) in [0, 1]; its widest
        spans are as wide as those of `count` control points with evenly spaced knots."""
        at = np.unique(np.clip(switches, self.finest, 1 - self.finest))
        return graded(at, repeat, 1 / (count - DEGREE), self.growth, next_to_end=0.0)

    def refined(self, knots: Array, switches: Array, repeat: int) -> Basis:
        """A space that contains that of `knots`: those nearest to the switches (k,) have
        multiplicity `repeat`, and no span is wider than `refined_widest`."""
        breaks = np.unique(knots)
        counts = np.ones(len(breaks), dtype=int)
        counts[np.abs(breaks[1:-1, None] - switches).argmin(axis=0) + 1] = repeat
        between = [
            np.linspace(a, b, math.ceil((b - a) / self.refined_widest) + 1)[1:-1]
            for a, b in pairwise(breaks)
        ]
        return Basis.of(clamped(np.sort(np.concatenate([np.repeat(breaks, counts), *between]))))
