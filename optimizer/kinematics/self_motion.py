"""Self-motions: curves of configurations that hold one pose.

`SelfMotion` is the interface; `six` and `seven` have the implementations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Protocol

import numpy as np

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.full_turns import nearest_turns
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
    limit_halvings: int = 5
    """Number of times the interval between a member within limits and its neighbour outside is
    halved. From the last member inside, ends slide to the limit."""


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


def up_to_limits(
    motions: Sequence[SelfMotion],
    parameters: Sequence[Array],
    q: Sequence[Array],
    limits: Limits,
    members: Callable[[Sequence[SelfMotion], Sequence[Array]], list[Array]],
) -> tuple[list[Array], list[Array]]:
    """Members of self-motions, with further members next to where the motions leave the limits.

    Arcs extend beyond the limits. Without these members, no sample would represent the part of an
    arc between its last member inside and the limit.

    Args:
        motions: self-motions.
        parameters: parameters of the members of each motion, shape (n,) [rad].
        q: members of each motion, shape (n, nq) [rad].
        limits: position limits.
        members: function that gives the members of motions at parameters.

    Returns:
        The parameters and the members of each motion.
    """
    inside = [np.array(nearest_turns(each, limits)[1], dtype=bool) for each in q]
    crossings = [_crossings(*each) for each in zip(motions, parameters, inside, strict=True)]
    chosen = [k for k, each in enumerate(crossings) if len(each)]
    if not chosen:
        return list(parameters), list(q)
    left = [motions[k] for k in chosen]
    held = [inside[k][crossings[k]] for k in chosen]
    ends = [np.stack([parameters[k][crossings[k] + by] for by in (0, 1)]) for k in chosen]
    within = [np.where(first, u[0], u[1]) for first, u in zip(held, ends, strict=True)]
    beyond = [np.where(first, u[1], u[0]) for first, u in zip(held, ends, strict=True)]
    for _ in range(SELF_MOTION.limit_halvings):
        middle = [(a + b) / 2 for a, b in zip(within, beyond, strict=True)]
        free = [nearest_turns(each, limits)[1] for each in members(left, middle)]
        within = [np.where(*each) for each in zip(free, middle, within, strict=True)]
        beyond = [np.where(*each) for each in zip(free, beyond, middle, strict=True)]
    found_parameters, found_q = list(parameters), list(q)
    for k, u, at in zip(chosen, within, members(left, within), strict=True):
        found_parameters[k] = np.insert(parameters[k], crossings[k] + 1, u)
        found_q[k] = np.insert(q[k], crossings[k] + 1, at, axis=0)
    return found_parameters, found_q


def _crossings(motion: SelfMotion, parameters: Array, inside: Mask) -> Array:
    """Indices of members of which either the member or the next one on its arc is inside."""
    arc = np.searchsorted(np.sort([arc[0] for arc in motion.arcs]), parameters, "right")
    is_next = (np.diff(arc) == 0) & (np.diff(parameters) > 0)
    return np.flatnonzero(is_next & (inside[1:] != inside[:-1]))
