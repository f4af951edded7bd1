"""What no round can go below: the least chain through the proven bounds of all its legs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.robot import Array
from optimizer.energy.dwell import dwell_energy, holding_power
from optimizer.kinematics.wrist_geometry import potential_rates
from optimizer.problem.work_round import WorkRound
from optimizer.search.lower_bound import LeastBound
from optimizer.sequence.chains import LeastChain
from optimizer.sequence.layers import Layer
from optimizer.sequence.legs import Leg


def proven_bound(asked: WorkRound, legs: Sequence[Leg]) -> float:
    """Lower bound [J] on the electrical energy of all rounds with rests at the stops.

    Where configurations are samples of infinitely many, or some may be missing, one more stands for all that are not
    known: from and to it no joint need move, and the potential energy falls as far as it can.
    """
    return LeastChain([_costs(asked, k, leg) for k, leg in enumerate(legs)], asked.closed).find()[0]


def _costs(asked: WorkRound, k: int, leg: Leg) -> Array:
    costs = leg.bound[leg.kind] + leg.dwell
    open_start, open_goal = (layer.sampled or not layer.complete for layer in (leg.start, leg.goal))
    if not open_start and not open_goal:
        return costs
    (_, most_start), (least_goal, _) = (_levels(leg, layer) for layer in (leg.start, leg.goal))
    bound, still = LeastBound(leg.prepared), np.zeros((1, leg.prepared.arm.robot.nq))
    fall = float(bound.of(still, np.array([least_goal - most_start]))[0])
    cycle = asked.dwell(k) if k < len(asked.stops) else None
    arm = asked.arms[k + 1] if k < len(asked.stops) else leg.prepared.arm
    dwell = 0.0 if cycle is None else dwell_energy(cycle, arm, float(holding_power(arm, still[0])), 0.0)
    if open_goal:
        costs = np.hstack([costs, np.full((len(costs), 1), fall + dwell)])
    if open_start:
        row = np.append(fall + leg.dwell, [fall + dwell] * open_goal)
        costs = np.vstack([costs, row])
    return costs


def _levels(leg: Leg, layer: Layer) -> tuple[float, float]:
    """Least and greatest potential energy [J] of all configurations of a layer, known or not.

    But for full turns, which change none, they differ from a known one by at most half a turn in each joint.
    """
    known = [leg.prepared.potential(end.q) for end in layer.ends]
    if not layer.sampled and layer.complete:
        return min(known), max(known)
    reach = np.pi * float(potential_rates(leg.prepared.model, leg.prepared.arm.gravity).sum())
    return max(known) - reach, min(known) + reach
