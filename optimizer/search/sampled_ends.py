"""Samples of targets that infinitely many configurations reach, and configurations between samples.

Such a target is a pose of partly free orientation, or a pose that the arm holds on a self-motion.
Samples of least lower bound are solved.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, bound
from joulepath.optimizer.search.ends import SIDES, label_of
from joulepath.optimizer.solve.methods.method import above


@dataclass(frozen=True)
class SampleSettings:
    """Settings of the choice of samples."""

    batch: int = 12
    """Number of samples solved before any is refined."""
    per_branch_pair: int = 2
    """Largest number of samples of one pair of branches in a batch."""
    most_refined: int = 4
    """Largest number of solved samples refined, each of another kind."""
    refined_ratio: float = 1.3
    """Largest ratio of the energy of a refined sample to the least energy."""
    equal_distance: float = 1e-6
    """Displacement [rad] below which configurations are equal."""


SAMPLES = SampleSettings()


def activate_deferred(
    candidates: Sequence[Candidate],
    batch: int = SAMPLES.batch,
    per_branch_pair: int = SAMPLES.per_branch_pair,
) -> bool:
    """Activate the deferred samples of least lower bound.

    Args:
        candidates: candidates of the search.
        batch: largest number of samples activated.
        per_branch_pair: largest number of active samples of one pair of branches. Below the
            default, samples that are active already count too.

    Returns:
        Whether any sample was deferred.
    """
    active: Counter[tuple[str, str, int]] = Counter()
    if per_branch_pair < SAMPLES.per_branch_pair:
        active.update(_branch_pair(each) for each in candidates if not each.deferred)
    by_bound = sorted(
        (each for each in candidates if each.deferred),
        key=lambda each: (each.lower_bound, each.shortest),
    )
    return activate_first(by_bound, batch, per_branch_pair, active)


def activate_first(
    candidates: Iterable[Candidate],
    batch: int = SAMPLES.batch,
    per_branch_pair: int = SAMPLES.per_branch_pair,
    active: Mapping[tuple[str, str, int], int] | None = None,
) -> bool:
    """Activate the first samples that are open, few of each pair of branches.

    Args:
        candidates: deferred candidates, the most promising first.
        batch: largest number of samples activated.
        per_branch_pair: largest number of active samples of one pair of branches.
        active: numbers of samples that are active already, by their pairs of branches.

    Returns:
        Whether any sample was activated.
    """
    active, activated = Counter(active or {}), 0
    for candidate in candidates:
        branch_pair = _branch_pair(candidate)
        is_open = candidate.status is CandidateStatus.UNVISITED
        if not is_open or active[branch_pair] >= per_branch_pair:
            continue
        active[branch_pair] += 1
        candidate.activate()
        activated += 1
        if activated == batch:
            break
    return activated > 0


def fastest_samples(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The samples of least proven duration: a batch, few of each pair of branches."""
    counts, chosen = Counter[tuple[str, str, int]](), list[Candidate]()
    for candidate in sorted(
        (each for each in candidates if (each.deferred or each.sampled) and each.holdable),
        key=lambda each: each.shortest,
    ):
        branch_pair = _branch_pair(candidate)
        counts[branch_pair] += 1
        if counts[branch_pair] <= SAMPLES.per_branch_pair and len(chosen) < SAMPLES.batch:
            chosen.append(candidate)
    return chosen


def _branch_pair(candidate: Candidate) -> tuple[str, str, int]:
    """Branches at the start and the goal of a candidate, and its target."""
    return candidate.start.label, candidate.goal.label, candidate.goal.target


def between(
    prepared: PreparedProblem,
    candidates: list[Candidate],
    q_start: Array,
    q_goal: Array,
    among: Sequence[Candidate] | None = None,
) -> Candidate:
    """The candidate between two configurations, or else the nearest candidate.

    If the candidate is missing only because an end is not among the samples of its target, it is
    appended to `candidates`.

    Args:
        prepared: problem of the motions.
        candidates: candidates of the search.
        q_start: start configuration, shape (nq,) [rad].
        q_goal: goal configuration, shape (nq,) [rad].
        among: candidates considered; by default all.
    """
    known = candidates if among is None else among

    def distance(candidate: Candidate) -> float:
        return _distance(candidate.q_start, q_start) + _distance(candidate.q_goal, q_goal)

    nearest = min(known, key=distance)
    if distance(nearest) < SAMPLES.equal_distance:
        return nearest
    curves: dict[tuple[SelfMotion | None, SelfMotion | None, int], Candidate] = {}
    for each in known:
        has_start = each.start.sampled or _is_equal(each.q_start, q_start)
        has_goal = each.goal.sampled or _is_equal(each.q_goal, q_goal)
        if has_start and has_goal:
            curves[each.start.self_motion, each.goal.self_motion, each.goal.target] = each
    for candidate in curves.values():
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
    """Refined candidates of the best sample of each kind, if they differ from the sample.

    Args:
        solved: solved samples.
        kind: kind of a sample.
        refine: the refinement, which returns the sample itself if it does not improve.
    """
    chosen: dict[Hashable, Candidate] = {}
    least = min((each.energy or 0.0 for each in solved), default=0.0)
    most = above(least, SAMPLES.refined_ratio)
    for candidate in sorted(solved, key=lambda each: each.energy or 0.0):
        if (candidate.energy or 0.0) <= most:
            chosen.setdefault(kind(candidate), candidate)
    best = list(chosen.values())[: SAMPLES.most_refined]
    refined = [(candidate, refine(candidate)) for candidate in best]
    return [better for candidate, better in refined if better is not candidate]


def with_ends(
    prepared: PreparedProblem, candidate: Candidate, q_start: Array, q_goal: Array
) -> Candidate | None:
    """The candidate between other configurations of its targets, with its bounds; None if
    infeasible.

    An end that is no sample does not move.

    Args:
        prepared: problem of the motions.
        candidate: candidate for the same targets.
        q_start: start configuration, shape (nq,) [rad].
        q_goal: goal configuration, shape (nq,) [rad].
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
    """The nearest configuration of a sampled end's target to q; None if it is outside of the
    limits.

    Args:
        prepared: problem of the motions.
        end: end configuration that is a sample.
        q: configuration, shape (nq,) [rad].
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


def is_on(motion: SelfMotion, q: Array) -> bool:
    """Whether q (nq,) [rad] is on a curve, up to rounding and full turns of joints.

    At a joint limit, rounding may take the nearest member beyond it.
    """
    (nearest,) = motion.at(np.array([motion.parameter(q)]))
    return float(np.abs(wrapped(nearest - q)).max()) < SAMPLES.equal_distance


def _reaches(prepared: PreparedProblem, end: EndConfiguration, q: Array) -> bool:
    """Whether q (nq,) [rad] reaches the target of an end; true for an end that is no sample."""
    if not end.sampled:
        return True
    if end.self_motion is not None:
        return is_on(end.self_motion, q)
    nearest = nearest_configuration(prepared, end, q)
    return nearest is not None and _is_equal(nearest, q)


def moved_end(prepared: PreparedProblem, end: EndConfiguration, q: Array) -> EndConfiguration:
    """The end at another configuration (nq,) [rad] of its target."""
    if not end.sampled:
        return end
    label = label_of(prepared.problem.arm.robot, q) if end.self_motion is None else end.label
    return replace(end, label=label, q=q, choices=[[value] for value in q.tolist()], fixed=True)


def _distance(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max())


def _is_equal(a: Array, b: Array) -> bool:
    return _distance(a, b) < SAMPLES.equal_distance
