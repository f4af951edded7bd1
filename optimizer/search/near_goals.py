"""Goals of free orientation: which of their configurations are solved first.

Samples of the orientation lie far apart on the manifold of goal configurations, the farther the
more joints the arm has. So every sample moves over the manifold to where the way from the start is
shortest nearby, weighed by friction. There are few such places. Of these, of the samples, and of
samples with a joint turned the other way around, those are solved where the expected energy is
least around.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason, bound
from joulepath.optimizer.search.end_feasibility import check_configurations
from joulepath.optimizer.search.other_turns import other_turns
from joulepath.optimizer.search.sampled_ends import activate_deferred, moved_end, on_branch
from joulepath.optimizer.search.seeds import NEAR_IN_WORK, estimates, expected
from joulepath.optimizer.solve.methods.method import above

# samples that move: those of least lower bound
MOST_MOVED = 384
# places that differ by less are the same [rad], and so many of them are kept
SAME_PLACE, MOST_PLACES = 0.1, 32
# configurations that are solved are farther apart in some joint [rad], are expected to need at most
# this ratio of the least energy that is expected, and are so many
APART, NEAR, MOST = 0.5, 1.15, 8
# of mechanical work, the straight line says more than the bound, and both say little
APART_FOR_WORK, NEAR_FOR_WORK, MOST_FOR_WORK = 0.7, NEAR_IN_WORK, 3
# samples of other branches that are solved, too, those of least lower bound: a straight line says
# little of motions that bend because of a torque's limit; of mechanical work, samples of least
# bound as if there were nothing else
OTHERS = 4
# share of a joint's torque that counts as friction: no way is for free [1]
DRAG = 1e-3


def activate_near_goals(prepared: PreparedProblem, candidates: list[Candidate]) -> bool:
    """Activate samples of goals of free orientation where the expected energy is least, and add new
    ones to `candidates`; false if no such sample is deferred.

    Some samples of least lower bound are activated, too. What is deferred stays so.
    """
    samples = [
        e
        for e in candidates
        if e.deferred and e.status is CandidateStatus.UNVISITED and e.goal.tolerance
    ]
    if not samples:
        return False
    by_bound = np.lexsort(
        ([each.shortest for each in samples], [each.lower_bound for each in samples])
    )
    samples = [samples[k] for k in by_bound[:MOST_MOVED].tolist()]
    pool = [*_moved(prepared, samples), *samples]
    is_work = prepared.problem.objective == "mechanical"
    if is_work:
        chosen = _least_around(
            pool, estimates(prepared, pool), APART_FOR_WORK, NEAR_FOR_WORK, MOST_FOR_WORK
        )
    else:
        energy = expected(prepared, pool)
        turned = other_turns(prepared, samples, float(energy.min()))
        if turned:
            pool, energy = [*pool, *turned], np.concatenate([energy, expected(prepared, turned)])
        chosen = _least_around(pool, energy, APART, NEAR, MOST)
    for each in chosen:
        if each.deferred:
            each.deferred = False
            each.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
        else:
            candidates.append(each)
    if is_work:
        activate_deferred(candidates)
    else:
        activate_deferred(candidates, OTHERS, 1)
    return True


def _moved(prepared: PreparedProblem, samples: Sequence[Candidate]) -> list[Candidate]:
    """Samples at the different places to which they came and at which the arm can be: those of the
    shortest way.
    """
    law, limits = prepared.arm.friction_law, prepared.arm.active_limits
    weights = law.coulomb + law.viscous * limits.v_max / 2 + DRAG * limits.tau_max
    goals, starts = (
        np.array([getattr(each, name) for each in samples]) for name in ("q_goal", "q_start")
    )
    way = np.full(len(samples), np.inf)
    for pose in {id(each.goal.tolerance): each.goal.tolerance for each in samples}.values():
        assert pose is not None
        rows = np.array([k for k, each in enumerate(samples) if each.goal.tolerance is pose])
        goals[rows], reached = GoalManifold.of(prepared.arm, pose).nearest(
            goals[rows], starts[rows], weights
        )
        way[rows] = np.where(reached, np.abs(goals[rows] - starts[rows]) @ weights, np.inf)
    ends, kept = np.hstack([starts, goals]), list[int]()
    for k in np.argsort(way, kind="stable")[: int(np.isfinite(way).sum())].tolist():
        if not kept or np.abs(ends[kept] - ends[k]).max(axis=1).min() > SAME_PLACE:
            kept.append(k)
        if len(kept) == MOST_PLACES:
            break
    if kept:
        ruled = check_configurations(prepared, goals[kept])
        kept = [
            k
            for k, ruling in zip(kept, ruled, strict=True)
            if ruling is None and on_branch(prepared, goals[k])
        ]
    at_place = [moved_end(prepared, samples[k].goal, goals[k]) for k in kept]
    moved = [
        Candidate(samples[k].start, end, starts[k], end.q)
        for k, end in zip(kept, at_place, strict=True)
    ]
    if moved:
        bound(prepared, moved, [])
    return moved


def _least_around(
    pool: Sequence[Candidate], energy: Array, apart: float, near: float, count: int
) -> list[Candidate]:
    """At most so many candidates, each far `apart` [rad] from any that needs less of the energies
    (n,) [J], and of at most the ratio `near` of the least."""
    q = np.array([[*each.q_start, *each.q_goal] for each in pool])
    order = np.argsort(energy, kind="stable").tolist()
    most = above(float(energy[order[0]]), near)
    chosen = list[Candidate]()
    for place, k in enumerate(order):
        if energy[k] > most or len(chosen) == count:
            break
        if not place or np.abs(q[order[:place]] - q[k]).max(axis=1).min() > apart:
            chosen.append(pool[k])
    return chosen
