"""Targets that infinitely many configurations reach: which samples are solved, and configurations between samples.

Such a target is a pose whose orientation is free in part, or a pose that an arm holds on a self-motion. Its samples are
ordered by lower bound, and those of least bound are solved.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import numpy as np

from models.robot import Array
from optimizer.exceptions import JoulepathError, SingularPose
from optimizer.kinematics.angles import nearest_turn
from optimizer.kinematics.inverse import required_inverse_kinematics
from optimizer.kinematics.orientation_tolerance import nearest_orientation
from optimizer.kinematics.tcp import flange_pose, tcp_pose
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.search.candidates import Candidate, Reason, bound
from optimizer.search.ends import SIDES, EndConfiguration, label_of
from optimizer.solution import CandidateStatus

# samples solved before any is refined: in all, and of one pair of branches
BATCH, ALIKE = 12, 2
# solved samples that are refined, each of a kind of its own
MOST_REFINED = 4
# configurations that differ by less are the same [rad]
SAME = 1e-6


def activate_deferred(candidates: Sequence[Candidate]) -> bool:
    """Activate the deferred samples of least lower bound; false if there are none."""
    alike: Counter[tuple[str, str, int]] = Counter()
    opened = 0
    for candidate in sorted((e for e in candidates if e.deferred), key=lambda e: (e.lower_bound, e.shortest)):
        kind = (candidate.start.label, candidate.goal.label, candidate.goal.target)
        if candidate.status is not CandidateStatus.UNVISITED or alike[kind] == ALIKE:
            continue
        alike[kind] += 1
        candidate.deferred = False
        candidate.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
        opened += 1
        if opened == BATCH:
            break
    return opened > 0


def between(
    prepared: PreparedProblem,
    candidates: list[Candidate],
    q_start: Array,
    q_goal: Array,
    among: Sequence[Candidate] | None = None,
) -> Candidate:
    """The candidate (of `among`, default all) between two configurations (nq,) [rad], else the nearest one.

    If it is missing only because an end is not among the samples of its target, it is added to `candidates`.
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
        if _reaches(prepared, candidate.start, q_start) and _reaches(prepared, candidate.goal, q_goal):
            fresh = with_ends(prepared, candidate, q_start, q_goal)
            if fresh is not None:
                candidates.append(fresh)
                return fresh
    return nearest


def refine_best(
    solved: Sequence[Candidate], kind: Callable[[Candidate], Hashable], refine: Callable[[Candidate], Candidate]
) -> list[Candidate]:
    """The candidates that `refine` makes of the best sample of each kind, at most MOST_REFINED of them.

    `solved` are solved samples. A sample that `refine` returns unchanged is left out.
    """
    chosen: dict[Hashable, Candidate] = {}
    for candidate in sorted(solved, key=lambda each: each.energy or 0.0):
        chosen.setdefault(kind(candidate), candidate)
    refined = [(candidate, refine(candidate)) for candidate in list(chosen.values())[:MOST_REFINED]]
    return [better for candidate, better in refined if better is not candidate]


def with_ends(prepared: PreparedProblem, candidate: Candidate, q_start: Array, q_goal: Array) -> Candidate | None:
    """The candidate between other configurations (nq,) of its targets, with its bounds; None if that is infeasible.

    An end that is no sample stays where it is.
    """
    start, goal = _moved(prepared, candidate.start, q_start), _moved(prepared, candidate.goal, q_goal)
    fresh = Candidate(start, goal, q_start, q_goal)
    try:
        sampled = [name for name in SIDES if getattr(candidate, name).sampled]
        bound(prepared, [fresh], sampled if candidate.holdable else SIDES)
    except JoulepathError:
        return None
    return fresh


def nearest_configuration(prepared: PreparedProblem, end: EndConfiguration, q: Array) -> Array | None:
    """The configuration (nq,) of a sampled end's target that is nearest to q (nq,), if any is within the limits."""
    limits, found = prepared.problem.arm.active_limits, list[Array]()
    if end.self_motion is not None:
        principal = [end.self_motion.at(np.array([end.self_motion.parameter(q)]))[0]]
    else:
        assert end.tolerance is not None
        principal = _branches_of(prepared, end.tolerance, q)
    for branch in principal:
        near = nearest_turn(branch, q)
        if ((near >= limits.q_min) & (near <= limits.q_max)).all():
            found.append(near)
    return min(found, key=lambda near: _distance(near, q), default=None)


def _branches_of(prepared: PreparedProblem, pose: ConeOrientedPose, q: Array) -> list[Array]:
    """The branches, in [-pi, pi], of the pose with the allowed orientation nearest to that at q (nq,)."""
    arm = prepared.problem.arm
    T_base_tcp = pose.with_orientation(nearest_orientation(pose, tcp_pose(arm, q)[:3, :3])).T
    kinematics = required_inverse_kinematics(arm.robot, "goal")
    try:
        branches = kinematics.branches(flange_pose(T_base_tcp, arm.T_flange_tcp))
    except SingularPose:
        return []
    wanted = prepared.problem.branch
    return [each.q for each in branches if wanted is None or wanted.allows(each.label, each.singular)]


def _reaches(prepared: PreparedProblem, end: EndConfiguration, q: Array) -> bool:
    """Whether the end's target is reached at q (nq,); true of an end that is no sample."""
    if not end.sampled:
        return True
    nearest = nearest_configuration(prepared, end, q)
    return nearest is not None and _distance(nearest, q) < SAME


def _moved(prepared: PreparedProblem, end: EndConfiguration, q: Array) -> EndConfiguration:
    """The end at another configuration (nq,) of its target."""
    if not end.sampled:
        return end
    label = label_of(prepared.problem.arm.robot, q) if end.self_motion is None else end.label
    return replace(end, label=label, q=q, choices=[[value] for value in q.tolist()], fixed=True)


def _distance(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max())
