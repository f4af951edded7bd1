"""Families of candidates for mechanical work, equal up to full turns of the outer joints.

The bound on mechanical work rules out few candidates: tens to hundreds are left, most with far more
energy than the best. Candidates between the same branches, equal up to full turns of the outer half
of the joints, move the heavy links in the same way and have similar energies. They form a family.
At first, the member of least possible duration is solved for the whole family, then further members
of the best families.

This is a heuristic. On 96 random moves from joint positions to a pose, the family of the answer was
among the three families with the least energies of their first members, at most 1.42 times the
least one, and the answer was at most the fifth member. Of 102 other moves, two need 12 and 1 % less
than with all candidates solved, and one needs 2 % more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.state import SearchState


@dataclass(frozen=True)
class FamilySettings:
    """Settings of the families of candidates."""

    energy_ratio: float = 1.6
    """Largest ratio of a family's least energy to the best energy if it is solved further."""
    families: int = 4
    """Largest number of families solved further."""
    members: int = 6
    """Largest number of members of a family solved."""
    digits: int = 6
    """Number of decimal digits of displacements [rad] in which members agree."""


FAMILIES = FamilySettings()


def explore_families(state: SearchState, explore: Callable[[], object]) -> None:
    """Solve one member per family, then members of the best families.

    Candidates are left unvisited if they are neither solved nor excluded by their bounds.

    Args:
        state: state of the search.
        explore: solves all open candidates.
    """
    families = families_of(state)
    if all(len(each) == 1 for each in families):
        explore()
        return
    waiting = [each for family in families for each in family[1:]]
    for each in waiting:
        each.deferred = True
    explore()
    while _replace_hindered(state, families):
        explore()
    best = state.best()
    if best is None:
        _release(waiting)
        explore()
        return
    most = FAMILIES.energy_ratio * (best.energy or 0.0)
    near = [family for family in families if _energy(family) <= most]
    for family in sorted(near, key=_energy)[: FAMILIES.families]:
        _release(family[: FAMILIES.members])
    explore()
    settle_waiting(state, waiting)


def families_of(state: SearchState) -> list[list[Candidate]]:
    """The open and the solved candidates in families, the member of least possible duration first.

    There are none for the electrical objective, with its tighter bounds, for other methods, and for
    a tight bound: it requires a solve of every candidate.
    """
    asked = state.problem
    if (asked.objective, asked.method) != ("mechanical", "bspline") or asked.bound == "tight":
        return []
    open_ = [each for each in state.candidates if each.status is not CandidateStatus.INFEASIBLE]
    if any(each.sampled or each.deferred for each in open_):
        return []
    families: dict[tuple[EndConfiguration, EndConfiguration, bytes], list[Candidate]] = {}
    for each in sorted(open_, key=lambda each: (each.shortest, each.lower_bound)):
        inner = (each.q_goal - each.q_start)[: len(each.q_start) // 2].round(FAMILIES.digits)
        # adding zero turns -0 into 0
        key = each.start, each.goal, (inner + 0.0).tobytes()
        families.setdefault(key, []).append(each)
    return list(families.values())


def _energy(family: Sequence[Candidate]) -> float:
    """Least known energy [J] of a family's members; inf if none is solved."""
    return min((each.energy for each in family if each.energy is not None), default=float("inf"))


def _replace_hindered(state: SearchState, families: Sequence[Sequence[Candidate]]) -> bool:
    """Release another member of the families with collisions only; whether there is any.

    Another turn of the wrist may be clear. A slower member cannot help against other limits.
    """
    found = False
    for family in families:
        tried = [each for each in family if each.attempt is not None]
        waiting = [each for each in family if each.deferred]
        if (
            not tried
            or not waiting
            or state.deadline.passed
            or not all(_collides(each) for each in tried)
        ):
            continue
        _release(waiting[:1])
        found = True
    return found


def _collides(candidate: Candidate) -> bool:
    """Whether a candidate was given up because its motion collides."""
    pruned = candidate.status is CandidateStatus.PRUNED and candidate.reason is Reason.METHOD
    return pruned or (candidate.attempt is not None and candidate.attempt.collision is not None)


def _release(candidates: Sequence[Candidate]) -> None:
    for each in candidates:
        each.deferred = False


def settle_waiting(
    state: SearchState, waiting: Sequence[Candidate], reason: Reason = Reason.FAMILY
) -> None:
    """Settle the candidates still deferred, unless the deadline ended the search.

    Args:
        state: state of the search.
        waiting: candidates.
        reason: reason for candidates with a bound below the incumbent.
    """
    left = [each for each in waiting if each.deferred]
    _release(left)
    best = state.best()
    if state.deadline.passed or best is None or best.energy is None:
        return
    for each in left:
        if each.status is CandidateStatus.UNVISITED:
            if each.lower_bound >= best.energy:
                each.settle(CandidateStatus.PRUNED, Reason.BOUND)
            else:
                each.settle(CandidateStatus.UNVISITED, reason)
