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
from joulepath.optimizer.kinematics.end_configuration import FULL_TURN
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, bound
from joulepath.optimizer.search.end_feasibility import check_configurations
from joulepath.optimizer.search.sampled_ends import activate_deferred, moved_end, on_branch
from joulepath.optimizer.search.seeds import SEEDS, estimates, estimates_between, expected
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
        chosen = _separate_minima(pool, estimates(prepared, pool), NEAR_GOALS.mechanical)
    else:
        energy = expected(prepared, pool)
        turned = other_turns(prepared, samples, float(energy.min()))
        if turned:
            pool, energy = [*pool, *turned], np.concatenate([energy, expected(prepared, turned)])
        chosen = _separate_minima(pool, energy, NEAR_GOALS.electrical)
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


def _separate_minima(
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


@dataclass(frozen=True)
class OtherTurnSettings:
    """Settings of the choice of motions with a joint turned the other way around."""

    most: int = 64
    """Largest number of motions, in order of their expected energies."""
    energy_ratio: float = 1.15
    """Largest ratio of the expected energy to the least expected energy."""


OTHER_TURNS = OtherTurnSettings()


def other_turns(
    prepared: PreparedProblem, samples: Sequence[Candidate], least: float
) -> list[Candidate]:
    """Samples with one joint turned the other way around and little expected energy.

    A sample has the full turns of least displacement; the other way around, a joint has more
    friction to overcome. But if a joint has about half a turn to go, friction is nearly the same
    both ways. Gravity is not, and still less the regenerated power that an isolated bus burns: one
    way may need twice as much energy as the other.

    The expected energy is the mean of a lower bound and a rough estimate, as in `seeds.expected`.
    The bound is the sample's plus the Coulomb loss of the joint's longer displacement. Starts that
    are given have no other turns.

    Args:
        prepared: problem of the motions.
        samples: samples.
        least: least expected energy of other motions [J].
    """
    if not prepared.problem.windings:
        return []
    limits = prepared.arm.active_limits
    coulomb = prepared.arm.friction_law.coulomb
    q_start, q_goal = (
        np.array([getattr(each, name) for each in samples]) for name in ("q_start", "q_goal")
    )
    displacement = q_goal - q_start
    given = np.array([[each.start.fixed] for each in samples])
    turn = -FULL_TURN * np.sign(displacement)
    at_goal = (q_goal + turn >= limits.q_min) & (q_goal + turn <= limits.q_max)
    at_start = (q_start - turn >= limits.q_min) & (q_start - turn <= limits.q_max) & ~given
    longer = np.abs(displacement + turn) - np.abs(displacement)
    bounds = np.array([[each.lower_bound] for each in samples]) + coulomb * longer
    most = above(least, OTHER_TURNS.energy_ratio)
    rows, joints = np.nonzero((at_goal | at_start) & (displacement != 0) & (bounds <= most))
    if not len(rows):
        return []
    each, by_goal, turn = np.arange(len(rows)), at_goal[rows, joints], turn[rows, joints]
    q_start, q_goal = q_start[rows], q_goal[rows]
    q_goal[each, joints] += np.where(by_goal, turn, 0.0)
    q_start[each, joints] -= np.where(by_goal, 0.0, turn)
    shortest = np.asarray(shortest_duration(q_goal - q_start, limits))
    energy = (
        estimates_between(prepared, q_start, q_goal, shortest, rough=True) + bounds[rows, joints]
    ) / 2
    turned = [
        Candidate(samples[rows[k]].start, samples[rows[k]].goal, q_start[k], q_goal[k])
        for k in np.argsort(energy, kind="stable")[: OTHER_TURNS.most].tolist()
        if energy[k] <= most
    ]
    if turned:
        bound(prepared, turned, [])
    return turned
