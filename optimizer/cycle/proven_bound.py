"""What no cycle can go below: the least chain through the proven bounds of all its legs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.free_ends_bound import bound_between_free_ends, reversed_problem
from joulepath.optimizer.bounds.free_goal_bound import family_bound
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.self_motion_bound import self_motion_bound
from joulepath.optimizer.bounds.subdivide import SearchLimits
from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.free_ends_chain import FreeEndsChain
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.cycle.passing_leg import PassingLeg
from joulepath.optimizer.cycle.rests import least_holding_power, rest_energy
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.covers.wrist_geometry import potential_rates
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.search.candidates import Candidate


def proven_bound(asked: Cycle, legs: Sequence[Leg], deadline: Deadline) -> float:
    """Lower bound [J] on the objective of all rounds with rests at the stops.

    Where configurations are samples of infinitely many, or some may be missing, one more stands for
    all that are not known, with a bound that holds for each of them; where they are all around a
    pose, they are bounded together.
    """
    single = [
        leg.direct if isinstance(leg, PassingLeg) and leg.direct is not None else leg
        for leg in legs
    ]
    chain = FreeEndsChain.of(asked, single)
    if chain is not None:
        return chain.least(deadline)
    return LeastChain(
        [bounded_costs(asked, *both, deadline) for both in zip(asked.moves, legs, strict=True)],
        asked.closed,
    ).find()[0]


def bounded_costs(asked: Cycle, move: PlannedMove, leg: Leg, deadline: Deadline) -> Array:
    """Lower bounds (s, g) [J] of the pairs of a leg, the dwell included, and of one more node where
    some are not known.

    That node comes last.
    """
    costs = leg.least_costs
    if isinstance(leg, PassingLeg) and leg.direct is not None:
        if not all(layer.complete and not layer.sampled for layer in leg.between):
            # the bound of the travel is that of the known passes
            costs = leg.direct.least_costs
        leg = leg.direct
    open_start, open_goal = (layer.sampled or not layer.complete for layer in (leg.start, leg.goal))
    if not open_start and not open_goal:
        return costs
    least = _of_unknown(leg, float(leg.bound.min()), deadline)
    electrical = asked.objective == "electrical"
    dwell = rest_energy(asked, move, move.dwell, least_holding_power(move)) if electrical else 0.0
    if open_goal:
        costs = np.hstack([costs, np.full((len(costs), 1), least + dwell)])
    if open_start:
        costs = np.vstack([costs, np.append(least + leg.dwell, [least + dwell] * open_goal)])
    return costs


def _of_unknown(leg: Leg, enough: float, deadline: Deadline) -> float:
    """Bound [J] on the motions of a leg of which an end is not known; no more than `enough` is
    needed of it.
    """
    if all(layer.complete and not layer.some for layer in leg.layers):
        return _of_curves(leg, deadline)
    if all(
        layer.around is not None or (layer.complete and not layer.sampled) for layer in leg.layers
    ):
        return _of_turned(leg, enough, deadline)
    return _of_any(leg)


def _of_turned(leg: Leg, enough: float, deadline: Deadline) -> float:
    """Bound [J] on the motions of a leg of which an end is in any configuration of a pose that is
    turned about an axis."""
    problem, start, goal = leg.prepared.freed(), leg.start, leg.goal
    if start.around is not None and goal.around is not None:
        return bound_between_free_ends(
            PreparedProblem.of(problem), start.around, goal.around, deadline, enough
        )
    if goal.around is not None:
        q = np.array([end.q for end in start.ends])
        limits = SearchLimits(deadline=deadline, enough=enough)
        return family_bound(PreparedProblem.of(problem), goal.around, q, limits)
    assert start.around is not None
    back = PreparedProblem.of(reversed_problem(problem, problem.goal, problem.start))
    q = np.array([end.q for end in goal.ends])
    limits = SearchLimits(deadline=deadline, enough=enough)
    return family_bound(back, start.around, q, limits)


def _of_curves(leg: Leg, deadline: Deadline) -> float:
    """Bound [J] on the motions of a leg of which an end is any member of a self-motion."""
    some = [
        next((end for end in layer.ends if end.sampled), layer.ends[0])
        for layer in (leg.start, leg.goal)
    ]
    # paired with one on a curve, every end of the other side counts
    ends = [(leg.start.ends, some[1:]), (some[:1], leg.goal.ends)]
    pairs = [Candidate(s, g, s.q, g.q) for starts, goals in ends for s, g in product(starts, goals)]
    return self_motion_bound(leg.prepared, pairs, deadline)


def _of_any(leg: Leg) -> float:
    """Bound [J] on the motions of a leg between any two configurations: no joint need move, and the
    potential energy falls as far as it can."""
    (_, most), (least, _) = (_levels(leg, layer) for layer in (leg.start, leg.goal))
    still = np.zeros((1, leg.prepared.arm.robot.nq))
    return float(LeastBound(leg.prepared).of(still, np.array([least - most]))[0])


def _levels(leg: Leg, layer: Layer) -> tuple[float, float]:
    """Least and greatest potential energy [J] of all configurations of a layer, known or not.

    But for full turns, which change none, they differ from a known one by at most half a turn in
    each joint.
    """
    known = [leg.prepared.potential(end.q) for end in layer.ends]
    if layer.complete and not layer.sampled:
        return min(known), max(known)
    reach = np.pi * float(potential_rates(leg.prepared.model, leg.prepared.arm.gravity).sum())
    return max(known) - reach, min(known) + reach
