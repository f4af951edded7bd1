"""Lower bound of a cycle: the least chain through proven bounds of all its legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
from joulepath.optimizer.cycle.rest_energy import least_dwell_cost
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.covers.wrist_geometry import greatest_rates
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.search.candidates import Candidate


@dataclass(frozen=True)
class ProvenBoundSettings:
    """Settings of the lower bound of a cycle."""

    overtime: float = 2.0
    """Time after the deadline in which poses are still covered for the first time [s]: a search
    that used all of its time would otherwise have hardly any bound. It is less than half of the
    time in which a service waits for a late answer."""


PROVEN_BOUND = ProvenBoundSettings()


def proven_bound(cycle: Cycle, legs: Sequence[Leg], deadline: Deadline) -> float:
    """Lower bound [J] of the objective of all cycles with rests at the stops.

    Samples of infinitely many configurations, and layers with missing branches, get one more node
    for all unknown configurations, with a bound for all of them. Configurations of poses with a
    free orientation are bounded together.
    """
    single = [
        leg.direct if isinstance(leg, PassingLeg) and leg.direct is not None else leg
        for leg in legs
    ]
    chain = FreeEndsChain.of(cycle, single)
    if chain is not None:
        return chain.least(deadline)
    return LeastChain(
        [bounded_costs(cycle, *both, deadline) for both in zip(cycle.moves, legs, strict=True)],
        cycle.closed,
    ).find()[0]


def bounded_costs(cycle: Cycle, move: PlannedMove, leg: Leg, deadline: Deadline) -> Array:
    """Lower bounds (s, g) [J] of the pairs of a leg with the dwell.

    A layer with unknown configurations gets a last node for these.
    """
    costs = leg.least_costs
    if isinstance(leg, PassingLeg) and leg.direct is not None:
        if not all(layer.closed for layer in leg.between):
            # the bound of the travel holds for the known passes alone
            costs = leg.direct.least_costs
        leg = leg.direct
    open_start, open_goal = (not layer.closed for layer in (leg.start, leg.goal))
    if not open_start and not open_goal:
        return costs
    least = _bound_of_unknown(leg, float(leg.bound.min()), deadline)
    dwell = least_dwell_cost(cycle, move)
    if open_goal:
        costs = np.hstack([costs, np.full((len(costs), 1), least + dwell)])
    if open_start:
        costs = np.vstack([costs, np.append(least + leg.dwell, [least + dwell] * open_goal)])
    return costs


def _bound_of_unknown(leg: Leg, enough: float, deadline: Deadline) -> float:
    """Bound [J] of the motions of a leg with an unknown end; a bound of `enough` suffices.

    Long after the deadline it is the weakest one: even the first cover of a pose by boxes takes
    some 0.3 s, and a cycle has many legs.
    """
    if deadline.earlier_by(-PROVEN_BOUND.overtime).passed:
        return _bound_of_any(leg)
    if all(layer.complete and not layer.sampled_poses for layer in leg.layers):
        return _bound_of_self_motions(leg, deadline)
    if all(layer.free_pose is not None or layer.closed for layer in leg.layers):
        return _bound_of_free_poses(leg, enough, deadline)
    return _bound_of_any(leg)


def _bound_of_free_poses(leg: Leg, enough: float, deadline: Deadline) -> float:
    """Bound [J] of the motions of a leg with an end in any configuration of a pose turned about an
    axis.
    """
    problem, start, goal = leg.prepared.freed(), leg.start, leg.goal
    prepared = leg.prepared.beside(problem)
    if start.free_pose is not None and goal.free_pose is not None:
        return bound_between_free_ends(prepared, start.free_pose, goal.free_pose, deadline, enough)
    free, fixed = goal, start
    if goal.free_pose is None:
        free, fixed = start, goal
        prepared = PreparedProblem.of(reversed_problem(problem, problem.goal, problem.start))
    assert free.free_pose is not None
    q = np.array([end.q for end in fixed.ends])
    return family_bound(prepared, free.free_pose, q, SearchLimits(deadline=deadline, enough=enough))


def _bound_of_self_motions(leg: Leg, deadline: Deadline) -> float:
    """Bound [J] of the motions of a leg with an end anywhere on a self-motion."""
    samples = [
        next((end for end in layer.ends if end.sampled), layer.ends[0])
        for layer in (leg.start, leg.goal)
    ]
    # an end on a self-motion is paired with every end of the other side
    ends = [(leg.start.ends, samples[1:]), (samples[:1], leg.goal.ends)]
    pairs = [Candidate(s, g, s.q, g.q) for starts, goals in ends for s, g in product(starts, goals)]
    return self_motion_bound(leg.prepared, pairs, deadline)


def _bound_of_any(leg: Leg) -> float:
    """Bound [J] of the motions of a leg between any two configurations.

    No joint needs to move, and the potential energy falls as far as it can.
    """
    (_, most), (least, _) = (_levels(leg, layer) for layer in (leg.start, leg.goal))
    still = np.zeros((1, leg.prepared.arm.robot.nq))
    return float(LeastBound(leg.prepared).of(still, np.array([least - most]))[0])


def _levels(leg: Leg, layer: Layer) -> tuple[float, float]:
    """Least and greatest potential energy [J] of all configurations of a layer, known or not.

    Up to full turns, every configuration differs from a known one by at most half a turn of every
    joint.
    """
    known = [leg.prepared.potential(end.q) for end in layer.ends]
    if layer.closed:
        return min(known), max(known)
    reach = np.pi * float(greatest_rates(leg.prepared.arm).sum())
    return max(known) - reach, min(known) + reach
