"""Members of self-motions in addition to evenly spread ones, where these represent too little."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

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


def _crossings(motion: SelfMotion, parameters: Array, inside: Mask) -> npt.NDArray[np.intp]:
    """Indices of members of which either the member or the next one on its arc is inside."""
    arc = np.searchsorted(np.sort([arc[0] for arc in motion.arcs]), parameters, "right")
    is_next = (np.diff(arc) == 0) & (np.diff(parameters) > 0)
    return np.flatnonzero(is_next & (inside[1:] != inside[:-1]))
