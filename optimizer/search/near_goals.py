"""Choice of the first configurations solved for goals of partly free orientation.

Samples of the orientation lie far apart on the manifold of goal configurations, farther the more
joints the arm has. So every sample moves over the manifold to the nearest shortest path from the
start, in displacements weighted by friction. There are few such places. Of these places, the
samples, and the samples with a joint turned the other way, configurations of locally least expected
energy are solved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, bound
from joulepath.optimizer.search.end_feasibility import check_configurations
from joulepath.optimizer.search.other_turns import other_turns
from joulepath.optimizer.search.sampled_ends import activate_deferred, moved_end, on_branch
from joulepath.optimizer.search.seeds import SEEDS, estimates, expected
from joulepath.optimizer.solve.methods.method import above


@dataclass(frozen=True)
class ChoiceSettings:
    """Settings of the choice of configurations by their expected energy."""

    separation: float
    """Least displacement [rad] of some joint from every configuration of less expected energy."""
    energy_ratio: float
    """Largest ratio of the expected energy to the least expected energy."""
    count: int
    """Largest number of configurations."""


@dataclass(frozen=True)
class NearGoalSettings:
    """Settings of the choice of goals of partly free orientation."""

    most_moved: int = 384
    """Largest number of samples that move, in order of their lower bounds."""
    place_distance: float = 0.1
    """Displacement [rad] in every joint below which two places are the same."""
    most_places: int = 32
    """Largest number of places."""
    electrical: ChoiceSettings = ChoiceSettings(separation=0.5, energy_ratio=1.15, count=8)
    """Choice for the electrical objective."""
    mechanical: ChoiceSettings = ChoiceSettings(
        separation=0.7, energy_ratio=SEEDS.work_ratio, count=3
    )
    """Choice for mechanical work, for which straight lines and bounds predict little."""
    others: int = 4
    """Number of samples of other branches solved too, in order of their lower bounds.

    A straight line predicts little of motions that bend because of a torque limit. For mechanical
    work, samples are activated as if there were no other choice.
    """
    drag: float = 1e-3
    """Share of the torque limit that counts as friction, so that no displacement is free [1]."""


NEAR_GOALS = NearGoalSettings()


def activate_near_goals(prepared: PreparedProblem, candidates: list[Candidate]) -> bool:
    """Activate samples of free goals with locally least expected energy, and add configurations.

    Some samples of least lower bound are activated too. The others stay deferred.

    Args:
        prepared: problem of the motions.
        candidates: candidates of the search; configurations between samples are appended.

    Returns:
        Whether any sample of a free goal was deferred.
    """
    samples = [
        each
        for each in candidates
        if each.deferred and each.status is CandidateStatus.UNVISITED and each.goal.tolerance
    ]
    if not samples:
        return False
    by_bound = np.lexsort(
        ([each.shortest for each in samples], [each.lower_bound for each in samples])
    )
    samples = [samples[k] for k in by_bound[: NEAR_GOALS.most_moved].tolist()]
    pool = [*_moved(prepared, samples), *samples]
    is_work = prepared.problem.objective == "mechanical"
    if is_work:
        chosen = _local_minima(pool, estimates(prepared, pool), NEAR_GOALS.mechanical)
    else:
        energy = expected(prepared, pool)
        turned = other_turns(prepared, samples, float(energy.min()))
        if turned:
            pool, energy = [*pool, *turned], np.concatenate([energy, expected(prepared, turned)])
        chosen = _local_minima(pool, energy, NEAR_GOALS.electrical)
    for each in chosen:
        if each.deferred:
            each.activate()
        else:
            candidates.append(each)
    if is_work:
        activate_deferred(candidates)
    else:
        activate_deferred(candidates, NEAR_GOALS.others, 1)
    return True


def _moved(prepared: PreparedProblem, samples: Sequence[Candidate]) -> list[Candidate]:
    """Feasible candidates at the distinct places to which samples moved, shortest paths first."""
    law, limits = prepared.arm.friction_law, prepared.arm.active_limits
    weights = law.coulomb + law.viscous * limits.v_max / 2 + NEAR_GOALS.drag * limits.tau_max
    goals, starts = (
        np.array([getattr(each, name) for each in samples]) for name in ("q_goal", "q_start")
    )
    cost = np.full(len(samples), np.inf)
    for target, pose in {each.goal.target: each.goal.tolerance for each in samples}.items():
        assert pose is not None
        rows = np.array([k for k, each in enumerate(samples) if each.goal.target == target])
        goals[rows], reached = GoalManifold.of(prepared.arm, pose).nearest(
            goals[rows], starts[rows], weights
        )
        cost[rows] = np.where(reached, np.abs(goals[rows] - starts[rows]) @ weights, np.inf)
    ends, kept = np.hstack([starts, goals]), list[int]()
    for k in np.argsort(cost, kind="stable")[: int(np.isfinite(cost).sum())].tolist():
        distances = np.abs(ends[kept] - ends[k]).max(axis=1)
        if not kept or distances.min() > NEAR_GOALS.place_distance:
            kept.append(k)
        if len(kept) == NEAR_GOALS.most_places:
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


def _local_minima(
    pool: Sequence[Candidate], energy: Array, settings: ChoiceSettings
) -> list[Candidate]:
    """Candidates of locally least energy.

    Args:
        pool: candidates.
        energy: expected energies, shape (n,) [J].
        settings: settings of the choice.
    """
    q = np.array([[*each.q_start, *each.q_goal] for each in pool])
    order = np.argsort(energy, kind="stable").tolist()
    most = above(float(energy[order[0]]), settings.energy_ratio)
    chosen = list[Candidate]()
    for rank, k in enumerate(order):
        if energy[k] > most or len(chosen) == settings.count:
            break
        if not rank or np.abs(q[order[:rank]] - q[k]).max(axis=1).min() > settings.separation:
            chosen.append(pool[k])
    return chosen
