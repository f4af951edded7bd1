"""Self-motions: curves of configurations that hold one pose.

`SelfMotion` is the interface; `six` and `seven` have the implementations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Protocol

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import nearest_turn
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
    limit_samples: int = 33
    """Number of members between one within limits and its neighbour outside, of which the last one
    inside is taken. From there, ends slide to the limit."""

    first_parts: int = 128
    """Number of parts of a self-motion whose middles are tested if its members are outside the
    limits.
    """
    part_halvings: int = 24
    """Largest number of times a part is halved whose box meets the limits while no middle is
    inside: down to 3e-9 rad.
    """
    most_parts: int = 2048
    """Number of parts above which none is halved: at a singularity, boxes may not shrink."""


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


def nearest_on_arcs(
    parameter: float, arcs: Sequence[tuple[float, float]], periodic: bool = True
) -> float:
    """Parameter [rad] on one of the arcs that is nearest to a given one.

    If the curve is `periodic`, a full turn of the parameter leads to the same member.
    """
    found = list[tuple[float, float]]()
    for lower, upper in arcs:
        middle = np.asarray((lower + upper) / 2)
        near = float(nearest_turn(np.asarray(parameter), middle)) if periodic else parameter
        on_arc = min(max(near, lower), upper)
        found.append((abs(near - on_arc), on_arc))
    return min(found)[1]


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
