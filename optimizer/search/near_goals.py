"""Choice of the first configurations solved for goals of partly free orientation.

Samples of the orientation lie far apart on the manifold of goal configurations, farther the more
joints the arm has. So every sample moves over the manifold to the nearest shortest path from the
start, in displacements weighted by friction. There are few such places. Of these places, the
samples, and the samples with a joint turned the other way, configurations of locally least expected
energy are solved.

If the place to which a sample moves collides with the scene, the sample moves only part of the way.
Such configurations are close to obstacles and may be hard to reach. They are therefore chosen
separately, in addition to the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.end_configuration import FULL_TURN
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, bound
from joulepath.optimizer.search.end_feasibility import are_feasible
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
    beside_obstacles: ChoiceSettings = ChoiceSettings(separation=0.3, energy_ratio=1.3, count=4)
    """Choice of the configurations between samples and places that collide."""
    approach: tuple[float, ...] = (0.8, 0.6, 0.4, 0.2)
    """Shares of the way from a sample to a place that collides, tried in turn."""
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
    moved, beside_obstacles = _moved(prepared, samples)
    pool = [*moved, *samples]
    is_work = prepared.problem.objective == "mechanical"
    if is_work:
        chosen = _separate_minima(pool, estimates(prepared, pool), NEAR_GOALS.mechanical)
    else:
        energy = expected(prepared, pool)
        turned = other_turns(prepared, samples, float(energy.min()))
        if turned:
            pool, energy = [*pool, *turned], np.concatenate([energy, expected(prepared, turned)])
        chosen = _separate_minima(pool, energy, NEAR_GOALS.electrical)
    if beside_obstacles:
        energy = (estimates if is_work else expected)(prepared, beside_obstacles)
        chosen += _separate_minima(beside_obstacles, energy, NEAR_GOALS.beside_obstacles)
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


def _moved(
    prepared: PreparedProblem, samples: Sequence[Candidate]
) -> tuple[list[Candidate], list[Candidate]]:
    """Feasible candidates at the distinct places to which samples moved, shortest paths first.

    Returns:
        The candidates at these places, and those on the way to places that collide with the scene.
    """
    law, limits = prepared.arm.friction_law, prepared.arm.active_limits
    weights = law.coulomb + law.viscous * limits.v_max / 2 + NEAR_GOALS.drag * limits.tau_max
    goals, starts = (
        np.array([getattr(each, name) for each in samples]) for name in ("q_goal", "q_start")
    )
    between, is_between = goals.copy(), np.zeros(len(samples), dtype=bool)
    reached = is_between.copy()
    for target, pose in {each.goal.target: each.goal.tolerance for each in samples}.items():
        assert pose is not None
        rows = np.array([k for k, each in enumerate(samples) if each.goal.target == target])
        manifold = GoalManifold.of(prepared.arm, pose)
        nearest, reached[rows] = manifold.nearest(goals[rows], starts[rows], weights)
        if prepared.arm.scene.names:
            between[rows], is_between[rows] = _short_of_collisions(
                prepared, manifold, goals[rows], nearest
            )
        goals[rows] = nearest

    def at(places: Array, is_place: Mask) -> list[Candidate]:
        cost = np.where(is_place, np.abs(places - starts) @ weights, np.inf)
        return _at_places(prepared, samples, places, cost)

    return at(goals, reached), at(between, reached & is_between)


def _short_of_collisions(
    prepared: PreparedProblem, manifold: GoalManifold, q: Array, places: Array
) -> tuple[Array, Mask]:
    """The farthest feasible configurations tried on the ways to places that are infeasible.

    Args:
        prepared: problem of the motions.
        manifold: manifold of the goal.
        q: feasible configurations on the manifold, shape (n, nq) [rad].
        places: their places on the manifold, shape (n, nq) [rad].

    Returns:
        The configurations (n, nq) [rad], and a mask (n,) of the rows with one.
    """
    found, is_found = q.copy(), np.zeros(len(q), dtype=bool)
    is_open = ~are_feasible(prepared, places)
    for share in NEAR_GOALS.approach:
        rows = np.flatnonzero(is_open & ~is_found)
        if len(rows):
            found[rows], reached = manifold.put(q[rows] + share * (places[rows] - q[rows]))
            is_found[rows] = reached & are_feasible(prepared, found[rows])
    return found, is_found


def _at_places(
    prepared: PreparedProblem, samples: Sequence[Candidate], places: Array, cost: Array
) -> list[Candidate]:
    """Feasible candidates at the distinct places of samples.

    Args:
        prepared: problem of the motions.
        samples: the samples.
        places: their places, shape (n, nq) [rad].
        cost: lengths of the paths to these, shape (n,), shortest first; infinite without a place.
    """
    ends = np.hstack([np.array([each.q_start for each in samples]), places])
    kept = list[int]()
    for k in np.argsort(cost, kind="stable")[: int(np.isfinite(cost).sum())].tolist():
        distances = np.abs(ends[kept] - ends[k]).max(axis=1)
        if not kept or distances.min() > NEAR_GOALS.place_distance:
            kept.append(k)
        if len(kept) == NEAR_GOALS.most_places:
            break
    if kept:
        feasible = are_feasible(prepared, places[kept])
        kept = [k for k, is_feasible in zip(kept, feasible, strict=True) if is_feasible]
    at_place = [
        (samples[k].start, moved_end(prepared, samples[k].goal, places[k]), samples[k].q_start)
        for k in kept
        if on_branch(prepared, places[k])
    ]
    moved = [Candidate(start, end, q_start, end.q) for start, end, q_start in at_place]
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
