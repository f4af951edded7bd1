"""Targets that infinitely many configurations reach: which samples are solved, and configurations
between samples.

Such a target is a pose whose orientation is free in part, or a pose that an arm holds on a
self-motion. Its samples are ordered by lower bound, and those of least bound are solved.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason, bound
from joulepath.optimizer.search.ends import SIDES, label_of
from joulepath.optimizer.solve.methods.sqp_method import above

# samples solved before any is refined: in all, and of one pair of branches
BATCH, ALIKE = 12, 2
# solved samples that are refined, each of a kind of its own: so many, of at most this ratio of the
# least energy
MOST_REFINED, WORTH_REFINING = 4, 1.3
# configurations that differ by less are the same [rad]
SAME = 1e-6


def activate_deferred(
    candidates: Sequence[Candidate], batch: int = BATCH, most_alike: int = ALIKE
) -> bool:
    """Activate the deferred samples of least lower bound; false if there are none.

    At most `batch` of them, so that at most `most_alike` of a pair of branches are active then,
    unless all are.
    """
    alike: Counter[tuple[str, str, int]] = Counter()
    if most_alike < ALIKE:
        alike.update(_kind(each) for each in candidates if not each.deferred)
    opened = 0
    for candidate in sorted(
        (e for e in candidates if e.deferred), key=lambda e: (e.lower_bound, e.shortest)
    ):
        if (
            candidate.status is not CandidateStatus.UNVISITED
            or alike[_kind(candidate)] >= most_alike
        ):
            continue
        alike[_kind(candidate)] += 1
        candidate.deferred = False
        candidate.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
        opened += 1
        if opened == batch:
            break
    return opened > 0


def fastest_samples(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The deferred samples of least proven duration: at most BATCH, and at most ALIKE of a pair of
    branches.
    """
    alike, chosen = Counter[tuple[str, str, int]](), list[Candidate]()
    for candidate in sorted(
        (e for e in candidates if e.deferred and e.holdable), key=lambda e: e.shortest
    ):
        alike[_kind(candidate)] += 1
        if alike[_kind(candidate)] <= ALIKE and len(chosen) < BATCH:
            chosen.append(candidate)
    return chosen


def _kind(candidate: Candidate) -> tuple[str, str, int]:
    """The pair of branches that a candidate is of, and its target."""
    return candidate.start.label, candidate.goal.label, candidate.goal.target


def between(
    prepared: PreparedProblem,
    candidates: list[Candidate],
    q_start: Array,
    q_goal: Array,
    among: Sequence[Candidate] | None = None,
) -> Candidate:
    """The candidate (of `among`, default all) between two configurations (nq,) [rad], else the
    nearest one.

    If it is missing only because an end is not among the samples of its target, it is added to
    `candidates`.
    """
    known = candidates if among is None else among
    nearest = min(known, key=lambda e: _distance(e.q_start, q_start) + _distance(e.q_goal, q_goal))
    if _distance(nearest.q_start, q_start) + _distance(nearest.q_goal, q_goal) < SAME:
        return nearest
    kinds: dict[tuple[int, int, int], Candidate] = {}
    for each in known:
        same_start = each.start.sampled or _distance(each.q_start, q_start) < SAME
        same_goal = each.goal.sampled or _distance(each.q_goal, q_goal) < SAME
        if same_start and same_goal:
            kinds[id(each.start.self_motion), id(each.goal.self_motion), each.goal.target] = each
    for candidate in kinds.values():
        if _reaches(prepared, candidate.start, q_start) and _reaches(
            prepared, candidate.goal, q_goal
        ):
            fresh = with_ends(prepared, candidate, q_start, q_goal)
            if fresh is not None:
                candidates.append(fresh)
                return fresh
    return nearest


def refine_best(
    solved: Sequence[Candidate],
    kind: Callable[[Candidate], Hashable],
    refine: Callable[[Candidate], Candidate],
) -> list[Candidate]:
    """The candidates that `refine` makes of the best sample of each kind, at most MOST_REFINED of
    them, if its energy is not far above that of the best of all.

    `solved` are solved samples. A sample that `refine` returns unchanged is left out.
    """
    chosen: dict[Hashable, Candidate] = {}
    least = min((each.energy or 0.0 for each in solved), default=0.0)
    most = above(least, WORTH_REFINING)
    for candidate in sorted(solved, key=lambda each: each.energy or 0.0):
        if (candidate.energy or 0.0) <= most:
            chosen.setdefault(kind(candidate), candidate)
    refined = [(candidate, refine(candidate)) for candidate in list(chosen.values())[:MOST_REFINED]]
    return [better for candidate, better in refined if better is not candidate]


def with_ends(
    prepared: PreparedProblem, candidate: Candidate, q_start: Array, q_goal: Array
) -> Candidate | None:
    """The candidate between other configurations (nq,) of its targets, with its bounds; None if
    that is infeasible.

    An end that is no sample stays where it is.
    """
    start, goal = (
        moved_end(prepared, candidate.start, q_start),
        moved_end(prepared, candidate.goal, q_goal),
    )
    fresh = Candidate(start, goal, q_start, q_goal)
    try:
        sampled = [name for name in SIDES if getattr(candidate, name).sampled]
        bound(prepared, [fresh], sampled if candidate.holdable else SIDES)
    except JoulepathError:
        return None
    return fresh


def nearest_configuration(
    prepared: PreparedProblem, end: EndConfiguration, q: Array
) -> Array | None:
    """The configuration (nq,) of a sampled end's target that is nearest to q (nq,), if any is
    within the limits.
    """
    arm = prepared.problem.arm
    if end.self_motion is None:
        assert end.tolerance is not None
        (found,), (reached,) = GoalManifold.of(arm, end.tolerance).put(q[None])
        return np.asarray(found) if reached and on_branch(prepared, found) else None
    near = nearest_turn(end.self_motion.at(np.array([end.self_motion.parameter(q)]))[0], q)
    inside = (near >= arm.active_limits.q_min) & (near <= arm.active_limits.q_max)
    return near if inside.all() else None


def on_branch(prepared: PreparedProblem, q: Array) -> bool:
    """Whether a configuration (nq,) [rad] is on a branch that the problem allows."""
    wanted = prepared.problem.branch
    if wanted is None:
        return True
    return wanted.allows(required_inverse_kinematics(prepared.arm.robot, "goal").label(q))


def _reaches(prepared: PreparedProblem, end: EndConfiguration, q: Array) -> bool:
    """Whether the end's target is reached at q (nq,); true of an end that is no sample."""
    if not end.sampled:
        return True
    nearest = nearest_configuration(prepared, end, q)
    return nearest is not None and _distance(nearest, q) < SAME


def moved_end(prepared: PreparedProblem, end: EndConfiguration, q: Array) -> EndConfiguration:
    """The end at another configuration (nq,) of its target."""
    if not end.sampled:
        return end
    label = label_of(prepared.problem.arm.robot, q) if end.self_motion is None else end.label
    return replace(end, label=label, q=q, choices=[[value] for value in q.tolist()], fixed=True)


def _distance(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max())
