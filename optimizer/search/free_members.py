"""Dense samples of self-motions and of orientations, for ends whose coarse samples all collide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives, nearest_turns
from joulepath.optimizer.kinematics.self_motion import spread
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.targets import Target, members
from joulepath.optimizer.search.candidates import Candidate, bound, pairs
from joulepath.optimizer.search.end_feasibility import are_feasible
from joulepath.optimizer.search.ends import SAMPLING, SIDES, ends_of
from joulepath.optimizer.search.errors import InCollision
from joulepath.optimizer.search.path_ends import path_candidates

T = TypeVar("T")


@dataclass(frozen=True)
class FreeMemberSettings:
    """Settings of the dense samples."""

    members: int = 720
    """Number of members of a self-motion that are checked, about half a degree apart. Of these,
    about as many are kept as of coarse samples."""
    most_of_orientations: int = 384
    """Largest number of kept configurations of partly free orientation."""


FREE_MEMBERS = FreeMemberSettings()


def bounded(prepared: PreparedProblem, candidates: list[Candidate]) -> list[Candidate]:
    """Compute the lower bounds of candidates, with denser samples of an end if necessary.

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
            # the start of a tool path determines its goal
            name = "start" if prepared.problem.tool_path is not None else error.target
            if name in denser:
                raise
            denser.add(name)
            sides: dict[str, list[EndConfiguration]] = {
                side: list(dict.fromkeys(getattr(each, side) for each in candidates))
                for side in SIDES
            }
            sides[name] = denser_ends(
                prepared,
                name,
                getattr(prepared.problem, name),
                sides[name],
                lambda q: are_feasible(prepared, q),
            )
            if not sides[name]:
                raise
        candidates = (
            pairs(prepared, sides["start"], sides["goal"])
            if prepared.problem.tool_path is None
            else path_candidates(prepared, sides["start"])
        )


def denser_ends(
    prepared: PreparedProblem,
    name: str,
    target: Target,
    ends: Sequence[EndConfiguration],
    are_free: Callable[[Array], Mask],
) -> list[EndConfiguration]:
    """Free configurations of a target from dense samples; empty if the target has no samples.

    Args:
        prepared: the problem.
        name: name of the target in errors.
        target: target.
        ends: its end configurations from coarse samples.
        are_free: which configurations (n, nq) [rad] are free, as a mask (n,).
    """
    return [
        *_free_members(prepared, ends, are_free),
        *_free_orientations(prepared, name, target, are_free),
    ]


def _free_members(
    prepared: PreparedProblem,
    ends: Sequence[EndConfiguration],
    are_free: Callable[[Array], Mask],
) -> list[EndConfiguration]:
    """Free members of the self-motions of ends, in the order of the self-motions."""
    limits = prepared.arm.active_limits
    found = list[EndConfiguration]()
    of_motion = {end.self_motion: end for end in ends if end.self_motion is not None}
    for motion, end in of_motion.items():
        q, held = nearest_turns(motion.at(spread(motion, FREE_MEMBERS.members)), limits)
        q = q[np.array(held)]
        free = q[are_free(q)]
        for each in free[:: max(len(free) // SAMPLING.members, 1)]:
            choices = full_turn_alternatives(each, limits.q_min, limits.q_max)
            found.append(replace(end, q=each, choices=choices))
    return found


def _free_orientations(
    prepared: PreparedProblem, name: str, target: Target, are_free: Callable[[Array], Mask]
) -> list[EndConfiguration]:
    """Free configurations of the poses of partly free orientation of a target."""
    if not any(isinstance(each, ConeOrientedPose) for each in members(target)):
        return []
    ends = [
        end
        for end in ends_of(prepared, name, target, SAMPLING.dense)[0]
        if end.tolerance is not None
    ]
    free = np.flatnonzero(are_free(np.array([end.q for end in ends])))
    return [ends[k] for k in evenly_chosen(free.tolist(), FREE_MEMBERS.most_of_orientations)]


def evenly_chosen(items: Sequence[T], most: int) -> list[T]:
    """At most `most` items, evenly spread over their order."""
    count = min(len(items), most)
    return [items[k * len(items) // count] for k in range(count)]
