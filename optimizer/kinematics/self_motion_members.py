"""Members of self-motions in addition to evenly spread ones, where these represent too little."""

from __future__ import annotations

from math import ceil

import numpy as np

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.full_turns import nearest_turns
from joulepath.optimizer.kinematics.self_motion import SELF_MOTION, SelfMotion


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
    apart = np.abs(wrapped(np.diff(q, axis=0))).max(axis=1)
    far = (
        max(SELF_MOTION.largest_gap, SELF_MOTION.gap_ratio * float(np.median(apart)))
        if len(apart)
        else np.inf
    )
    for _ in range(SELF_MOTION.gap_halvings):
        apart = np.abs(wrapped(np.diff(q, axis=0))).max(axis=1) > far
        gaps = np.flatnonzero(apart & _has_next(motion, parameters))
        if not len(gaps):
            break
        between = (parameters[gaps] + parameters[gaps + 1]) / 2
        q = np.insert(q, gaps + 1, motion.at(between), axis=0)
        parameters = np.insert(parameters, gaps + 1, between)
    return q


def up_to_limits(
    motion: SelfMotion, parameters: Array, q: Array, limits: Limits
) -> tuple[Array, Array]:
    """Members of a self-motion, with further members next to where it leaves the limits.

    Arcs may extend beyond the limits. Without these members, no sample would represent the part of
    an arc between its last member inside and the limit.

    Args:
        motion: self-motion.
        parameters: parameters of the members, shape (n,), in the order of the arcs [rad].
        q: members, shape (n, nq) [rad].
        limits: position limits.

    Returns:
        The parameters (m,) and the members (m, nq).
    """
    inside = np.array(nearest_turns(q, limits)[1], dtype=bool)
    crossings = np.flatnonzero(_has_next(motion, parameters) & (inside[1:] != inside[:-1]))
    if not len(crossings):
        return parameters, q
    within = np.where(inside[crossings], crossings, crossings + 1)
    beyond = 2 * crossings + 1 - within
    between = np.linspace(parameters[within], parameters[beyond], SELF_MOTION.limit_samples)
    held = np.array(nearest_turns(motion.at(between.ravel()), limits)[1]).reshape(between.shape)
    # the last one before the first member outside
    last = between[np.argmin(held, axis=0) - 1, np.arange(len(crossings))]
    is_new = last != parameters[within]
    last, after = last[is_new], crossings[is_new] + 1
    return np.insert(parameters, after, last), np.insert(q, after, motion.at(last), axis=0)


def one_in_each_part(motion: SelfMotion, limits: Limits) -> Array:
    """Members of a self-motion within limits, one of each separate part that is found inside.

    A part may be as short as the range of one joint. The arcs are divided into cells, and cells
    whose boxes meet the limits are halved until a middle is inside. Adjacent cells count as one
    part. A part may be missed where it only touches the limits, or where the boxes do not shrink.

    Args:
        motion: self-motion.
        limits: position limits.

    Returns:
        The members (m, nq) [rad], m = 0 if none is found.
    """
    centre, width = (limits.q_min + limits.q_max) / 2, (limits.q_max - limits.q_min) / 2
    width = np.where(width < np.pi, width, np.inf)
    length = sum(upper - lower for lower, upper in motion.arcs)
    ends = [
        np.linspace(*arc, 1 + ceil(SELF_MOTION.first_parts * (arc[1] - arc[0]) / length))
        for arc in sorted(motion.arcs)
    ]
    low, high = np.concatenate([e[:-1] for e in ends]), np.concatenate([e[1:] for e in ends])
    found = [np.zeros((0, len(centre)))]
    for _ in range(SELF_MOTION.part_halvings):
        middle = (low + high) / 2
        box, half = motion.boxes(middle, (high - low) / 2)
        meets = (np.abs(wrapped(box - centre)) <= width + half).all(axis=1)
        low, high, middle = low[meets], high[meets], middle[meets]
        if not 0 < len(low) <= SELF_MOTION.most_parts:
            break
        q = motion.at(middle)
        inside = np.array(nearest_turns(q, limits)[1], dtype=bool)
        part = np.append(0, np.cumsum(low[1:] > high[:-1]))
        seen, first = np.unique(part[inside], return_index=True)
        found.append(q[inside][first])
        left = ~np.isin(part, seen)
        low, middle, high = low[left], middle[left], high[left]
        low, high = np.stack([low, middle], 1).ravel(), np.stack([middle, high], 1).ravel()
    return np.vstack(found)


def _has_next(motion: SelfMotion, parameters: Array) -> Mask:
    """Whether the next member (n - 1,) after each is on the same arc, at a greater parameter."""
    arc = np.searchsorted(np.sort([arc[0] for arc in motion.arcs]), parameters, "right")
    return np.asarray((np.diff(arc) == 0) & (np.diff(parameters) > 0))
