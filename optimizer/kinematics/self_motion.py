"""Self-motions: curves of configurations that hold one pose.

`SelfMotion` is the interface; `six` and `seven` have the implementations.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Protocol

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.problem.branches import BranchLabel


@dataclass(frozen=True)
class SelfMotionSettings:
    """Sampling of self-motions."""

    point_arc: float = 1e-4
    """Length of an arc below which it counts as one configuration [rad]."""
    largest_gap: float = 0.5
    """Joint distance of neighbouring members above which a gap is filled [rad]."""
    gap_ratio: float = 3.0
    """Ratio of a gap to the median distance above which it is filled."""
    gap_halvings: int = 6
    """Largest number of times a gap is halved."""


SELF_MOTION = SelfMotionSettings()


class SelfMotion(Protocol):
    """Curve of configurations that hold one pose, over a parameter on arcs of the circle."""

    @property
    def label(self) -> BranchLabel:
        """Branch of the curve; the singular part of the label has no meaning."""
        ...

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the moving joints."""
        ...

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """Intervals of the parameter [rad]."""
        ...

    def parameter(self, q: Array) -> float:
        """Parameter [rad] of the member nearest to q (nq,) [rad]."""
        ...

    def clipped(self, parameter: float) -> float:
        """Nearest parameter [rad] on an arc."""
        ...

    def at(self, parameter: Array) -> Array:
        """Configurations (n, nq) [rad], in [-pi, pi], at parameters (n,) on the arcs."""
        ...

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes in joint space that cover the curve within `half` (n,) of the parameters (n,).

        Full turns of a joint are ignored.

        Returns:
            Centres (n, nq) and half sides (n, nq) [rad] of the boxes.
        """
        ...


def is_point(motion: SelfMotion) -> bool:
    """Whether the curve is a single configuration, up to rounding."""
    return sum(upper - lower for lower, upper in motion.arcs) < SELF_MOTION.point_arc


def spread(motion: SelfMotion, count: int) -> Array:
    """At least `count` parameters, evenly spread over the arcs, with both ends of each arc.

    An arc below `point_arc` contributes its middle alone; the coinciding ends of a full circle
    count once.
    """
    length = sum(upper - lower for lower, upper in motion.arcs)
    found = list[float]()
    for lower, upper in motion.arcs:
        if upper - lower < SELF_MOTION.point_arc:
            found.append((lower + upper) / 2)
            continue
        pieces = max(2, ceil(count * (upper - lower) / length))
        step, closed = (upper - lower) / pieces, upper - lower > 2 * np.pi - SELF_MOTION.point_arc
        # Floats are several times faster than NumPy arrays of a few elements.
        found += [lower + step * k for k in range(pieces)]
        if not closed:
            found.append(upper)
    return np.array(found)


def without_gaps(motion: SelfMotion, parameters: Array, q: Array) -> Array:
    """Members of a self-motion, with further members inserted into wide gaps.

    Next to a singularity the arm moves far while the parameter hardly changes. A gap is filled if
    it exceeds both `largest_gap` and `gap_ratio` times the median distance of neighbours.

    Args:
        motion: self-motion.
        parameters: parameters of the members, shape (n,), in the order of the arcs [rad].
        q: members, shape (n, nq) [rad].

    Returns:
        All members, shape (m, nq) [rad].
    """
    lower = np.sort([arc[0] for arc in motion.arcs])
    apart = np.abs(wrapped(np.diff(q, axis=0))).max(axis=1)
    far = (
        max(SELF_MOTION.largest_gap, SELF_MOTION.gap_ratio * float(np.median(apart)))
        if len(apart)
        else np.inf
    )
    for _ in range(SELF_MOTION.gap_halvings):
        arc = np.searchsorted(lower, parameters, "right")
        apart = np.abs(wrapped(np.diff(q, axis=0))).max(axis=1) > far
        gaps = np.flatnonzero(apart & (np.diff(arc) == 0) & (np.diff(parameters) > 0))
        if not len(gaps):
            break
        between = (parameters[gaps] + parameters[gaps + 1]) / 2
        q = np.insert(q, gaps + 1, motion.at(between), axis=0)
        parameters = np.insert(parameters, gaps + 1, between)
    return q
