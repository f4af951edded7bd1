"""Goals of free orientation: which of their configurations are solved first.

Samples of the orientation lie far apart on the manifold of goal configurations, the farther the more joints the arm
has. So every sample moves over the manifold to where the way from the start is shortest nearby, weighed by friction.
There are few such places. Of these and of the samples, those are solved where the estimated energy is least around.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.robot import Array
from optimizer.kinematics.goal_manifold import GoalManifold
from optimizer.prepared_problem import PreparedProblem
from optimizer.search.candidates import Candidate, Reason, bound
from optimizer.search.end_feasibility import check_configurations
from optimizer.search.sampled_ends import activate_deferred, moved_end, on_branch
from optimizer.search.seeds import estimates_between, how_near
from optimizer.solution import CandidateStatus
from optimizer.trajectories.seven_segment import shortest_duration

# samples that move: those of least lower bound
MOST_MOVED = 384
# places that differ by less are the same [rad], and so many of them are kept
SAME_PLACE, MOST_PLACES = 0.1, 32
# configurations that are solved are farther apart in some joint [rad], need at most this ratio of the least estimate,
# and are so many
APART, NEAR, MOST = 0.7, 1.25, 6
# samples of other branches that are solved, too, those of least lower bound: a straight line says little of motions
# that bend because of a torque's limit
OTHERS = 4
# of mechanical work an estimate says less: fewer places are solved, and samples of least bound as if there were none
MOST_FOR_WORK = 3
# share of a joint's torque that counts as friction: no way is for free [1]
DRAG = 1e-3


def activate_near_goals(prepared: PreparedProblem, candidates: list[Candidate]) -> bool:
    """Activate samples of goals of free orientation where the estimated energy is least, and add new ones to
    `candidates`; false if no such sample is deferred.

    Some samples of least lower bound are activated, too. What is deferred stays so.
    """
    samples = [e for e in candidates if e.deferred and e.status is CandidateStatus.UNVISITED and e.goal.tolerance]
    if not samples:
        return False
    by_bound = np.lexsort(([each.shortest for each in samples], [each.lower_bound for each in samples]))
    samples = [samples[k] for k in by_bound[:MOST_MOVED].tolist()]
    moved, places = _places(prepared, samples)
    pool, q_goal = [*moved, *samples], np.concatenate([places, [each.q_goal for each in samples]])
    q_start = np.array([each.q_start for each in pool])
    shortest = np.asarray(shortest_duration(q_goal - q_start, prepared.arm.active_limits))
    energy = estimates_between(prepared, q_start, q_goal, shortest)
    is_work = prepared.problem.objective == "mechanical"
    near = max(NEAR, how_near(prepared.problem)[0])
    fresh = list[Candidate]()
    for k in _least_around(energy, np.hstack([q_start, q_goal]), near, MOST_FOR_WORK if is_work else MOST):
        candidate = pool[k]
        if k < len(moved):
            end = moved_end(prepared, candidate.goal, q_goal[k])
            fresh.append(Candidate(candidate.start, end, q_start[k], q_goal[k]))
        else:
            candidate.deferred = False
            candidate.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
    if fresh:
        bound(prepared, fresh, [])
        candidates += fresh
    if is_work:
        activate_deferred(candidates)
    else:
        activate_deferred(candidates, OTHERS, 1)
    return True


def _places(prepared: PreparedProblem, samples: Sequence[Candidate]) -> tuple[list[Candidate], Array]:
    """Samples that came to different places at which the arm can be, and these places (n, nq) [rad]: those of the
    shortest way first."""
    law, limits = prepared.arm.friction_law, prepared.arm.active_limits
    weights = law.coulomb + law.viscous * limits.v_max / 2 + DRAG * limits.tau_max
    goals, starts = (np.array([getattr(each, name) for each in samples]) for name in ("q_goal", "q_start"))
    way = np.full(len(samples), np.inf)
    for pose in {id(each.goal.tolerance): each.goal.tolerance for each in samples}.values():
        assert pose is not None
        rows = np.array([k for k, each in enumerate(samples) if each.goal.tolerance is pose])
        goals[rows], reached = GoalManifold.of(prepared.arm, pose).nearest(goals[rows], starts[rows], weights)
        way[rows] = np.where(reached, np.abs(goals[rows] - starts[rows]) @ weights, np.inf)
    ends, kept = np.hstack([starts, goals]), list[int]()
    for k in np.argsort(way, kind="stable")[: int(np.isfinite(way).sum())].tolist():
        if not kept or np.abs(ends[kept] - ends[k]).max(axis=1).min() > SAME_PLACE:
            kept.append(k)
        if len(kept) == MOST_PLACES:
            break
    if kept:
        ruled = check_configurations(prepared, goals[kept])
        kept = [k for k, ruling in zip(kept, ruled, strict=True) if ruling is None and on_branch(prepared, goals[k])]
    return [samples[k] for k in kept], goals[kept]


def _least_around(energy: Array, q: Array, near: float, count: int) -> list[int]:
    """Indices of at most so many configurations (n, r) [rad], each far from any that needs less of the energies (n,)
    [J], and at most the ratio `near` of the least."""
    order = np.argsort(energy, kind="stable").tolist()
    # an energy is negative where the supply takes more back than it gives
    most = energy[order[0]] + (near - 1) * abs(energy[order[0]])
    chosen = list[int]()
    for place, k in enumerate(order):
        if energy[k] > most or len(chosen) == count:
            break
        if not place or np.abs(q[order[:place]] - q[k]).max(axis=1).min() > APART:
            chosen.append(k)
    return chosen
