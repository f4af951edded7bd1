"""Dense samples of self-motions, for ends with collisions at all coarse samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives, nearest_turns
from joulepath.optimizer.kinematics.self_motion import spread
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate, bound, pairs
from joulepath.optimizer.search.end_feasibility import check_configurations
from joulepath.optimizer.search.ends import SAMPLING
from joulepath.optimizer.search.errors import InCollision


@dataclass(frozen=True)
class FreeMemberSettings:
    """Settings of the dense samples."""

    members: int = 720
    """Number of members of a self-motion that are checked, about half a degree apart. Of these,
    about as many are kept as of coarse samples."""


FREE_MEMBERS = FreeMemberSettings()


def bounded(prepared: PreparedProblem, candidates: list[Candidate]) -> list[Candidate]:
    """Compute the lower bounds of candidates, with denser samples of self-motions if necessary.

    Denser samples replace the samples of an end if all of them collide.

    Args:
        prepared: the problem.
        candidates: the candidates of the coarse samples.

    Returns:
        The candidates with bounds.

    Raises:
        InvalidProblem, InCollision, TorqueInfeasible: as `bound`.
    """
    denser = set[str]()
    while True:
        try:
            bound(prepared, candidates)
            return candidates
        except InCollision as error:
            if error.target in denser:
                raise
            denser.add(error.target)
            sides = {
                side: list(dict.fromkeys(getattr(each, side) for each in candidates))
                for side in ("start", "goal")
            }
            sides[error.target] = free_members(prepared, sides[error.target])
            if not sides[error.target]:
                raise
        candidates = pairs(prepared, sides["start"], sides["goal"])


def free_members(prepared: PreparedProblem, ends: list[EndConfiguration]) -> list[EndConfiguration]:
    """Feasible members of the self-motions of ends, in the order of the self-motions."""
    limits = prepared.arm.active_limits
    found = list[EndConfiguration]()
    of_motion = {end.self_motion: end for end in ends if end.self_motion is not None}
    for motion, end in of_motion.items():
        members = motion.at(spread(motion, FREE_MEMBERS.members))
        q, held = nearest_turns(members, limits)
        q = q[np.array(held)]
        free = [
            each
            for each, ruling in zip(q, check_configurations(prepared, q), strict=True)
            if ruling is None
        ]
        for each in free[:: max(len(free) // SAMPLING.members, 1)]:
            choices = full_turn_alternatives(each, limits.q_min, limits.q_max)
            found.append(replace(end, q=each, choices=choices))
    return found
