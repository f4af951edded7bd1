"""Least mechanical work: of candidates that differ by full turns of the outer joints, one is solved
for all at first.

The bound on mechanical work rules out little: tens to hundreds of candidates are left, and most of
them need far more energy than the best. Those between the same branches that differ only by full
turns of the outer half of the joints move the heavy links alike, and their energies are alike, too.
They are a family. At first, the member that can be the fastest is solved for all of it. Then those
of the best families are solved.

Nothing here is proven. On 96 random moves from joint positions to a pose, the family of the answer
was among the three whose first members need the least, at most 1.42 times as much as the best of
them; the answer was at most its fifth. Of 102 others, two need 12 and 1 % less than if all are
solved, and one needs 2 % more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.incumbent import Incumbent

# families are solved further if the energy of one of their members is at most this ratio of the
# best energy, so many of them, and so many members of each
NEAR, FAMILIES, MEMBERS = 1.6, 4, 6
# digits of displacements [rad] that are the same
DIGITS = 6


def explore_families(incumbent: Incumbent, explore: Callable[[], object]) -> None:
    """Solve one member of each family by `explore`, which solves all candidates that are open, then
    the best families.

    What neither a solve nor a bound rules out is left unvisited.
    """
    families = families_of(incumbent)
    if all(len(each) == 1 for each in families):
        explore()
        return
    waiting = [each for family in families for each in family[1:]]
    for each in waiting:
        each.deferred = True
    explore()
    while _replace_hindered(incumbent, families):
        explore()
    best = incumbent.best()
    if best is None:
        _release(waiting)
        explore()
        return
    near = [family for family in families if _energy(family) <= NEAR * (best.energy or 0.0)]
    for family in sorted(near, key=_energy)[:FAMILIES]:
        _release(family[:MEMBERS])
    explore()
    leave(incumbent, waiting)


def families_of(incumbent: Incumbent) -> list[list[Candidate]]:
    """The open and the solved candidates by family, the one of least possible duration first.

    None with another objective, whose bounds rule out enough, another method, or a tight bound, for
    which everything is solved.
    """
    asked = incumbent.problem
    if (asked.objective, asked.method) != ("mechanical", "bspline") or asked.bound == "tight":
        return []
    open_ = [each for each in incumbent.candidates if each.status is not CandidateStatus.INFEASIBLE]
    if any(each.sampled or each.deferred for each in open_):
        return []
    families: dict[tuple[int, int, bytes], list[Candidate]] = {}
    for each in sorted(open_, key=lambda each: (each.shortest, each.lower_bound)):
        inner = (each.q_goal - each.q_start)[: len(each.q_start) // 2].round(DIGITS)
        # adding zero makes -0 the same as 0
        families.setdefault((id(each.start), id(each.goal), (inner + 0.0).tobytes()), []).append(
            each
        )
    return list(families.values())


def _energy(family: Sequence[Candidate]) -> float:
    """The least energy [J] known of a family's members; inf if none is solved."""
    return min((each.energy for each in family if each.energy is not None), default=float("inf"))


def _replace_hindered(incumbent: Incumbent, families: Sequence[Sequence[Candidate]]) -> bool:
    """Let another member stand for each family of which all that were tried collide; whether there
    is any.

    Another turn of the wrist may be clear. What the limits do not allow, they allow no slower
    member either.
    """
    found = False
    for family in families:
        tried = [each for each in family if each.attempt is not None]
        waiting = [each for each in family if each.deferred]
        if (
            not tried
            or not waiting
            or incumbent.deadline.passed
            or not all(_collides(each) for each in tried)
        ):
            continue
        _release(waiting[:1])
        found = True
    return found


def _collides(candidate: Candidate) -> bool:
    """Whether a candidate was tried, and given up because its motion collides."""
    pruned = candidate.status is CandidateStatus.PRUNED and candidate.reason is Reason.METHOD
    return pruned or (candidate.attempt is not None and candidate.attempt.collision is not None)


def _release(candidates: Sequence[Candidate]) -> None:
    for each in candidates:
        each.deferred = False


def leave(
    incumbent: Incumbent, waiting: Sequence[Candidate], reason: Reason = Reason.FAMILY
) -> None:
    """Say why those that still wait are not solved, unless the deadline ended the search: their
    bound, or this reason."""
    left = [each for each in waiting if each.deferred]
    _release(left)
    best = incumbent.best()
    if incumbent.deadline.passed or best is None or best.energy is None:
        return
    for each in left:
        if each.status is CandidateStatus.UNVISITED:
            if each.lower_bound >= best.energy:
                each.settle(CandidateStatus.PRUNED, Reason.BOUND)
            else:
                each.settle(CandidateStatus.UNVISITED, reason)
