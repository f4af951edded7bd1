"""The power bus: where the joints' surplus goes, and the exact course of a store's charge.

P_j is what joint j takes from the bus, base = idle + controller, P_net = base + Σ_j P_j.

- `shared`        drawn = max(P_net, 0); the net surplus is burnt, but for the share that the robot's supply takes back
- `isolated`      drawn = base + Σ_j max(P_j, 0); every joint burns its own surplus
- `recuperating`  drawn = max(P_net, 0) - efficiency · max(-P_net, 0)
- `storage`       a capacitor or flywheel on the shared bus (Gale, Eielsen et al. 2015)

**The store's law.** Net surplus charges it, demand discharges it, each within `power` (at the bus) and its capacity,
and always as soon as possible; the round trip's loss is taken on the way in, so that the charge E is what can still be
given back: dE/dt = efficiency · charging - discharging. What finds no room is treated as on the shared bus.

**What it costs.** total = ∫ drawn dt + E(0) - E(T): charge used up counts as if it were drawn, charge left over, which
the idling electronics use first, as if it were given back. Putting in the law,

    total = ∫ max(P_net, 0) dt - efficiency · ∫ charging dt - (what the supply takes back of the rest),

so only charging saves, and discharging as early as possible is best: it leaves the most room. Proof: let C, D be what
any law has charged and discharged, C*, D* this one. While C* ≥ C and D* ≥ D hold, C can overtake only where C = C* and
the store of this law is full; then D* = E(0) + efficiency · C - capacity ≤ D, so D = D* and the other store is full as
well. D can overtake only where D = D* and the store of this law is empty; then D ≤ E(0) + efficiency · C ≤
E(0) + efficiency · C* = D*, so the other store is empty as well. Neither happens, so C* ≥ C throughout.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from models.robot import Array
from optimizer.problem.bus import Bus


@dataclass(frozen=True)
class BusFlow:
    """Energies [J] in the intervals (k,) that samples stand for: drawn from the supply, net surplus that is not stored,
    put into and taken out of the store (at the bus); and `charge` (k + 1,) of the store at the intervals' ends.
    """

    drawn: Array
    surplus: Array
    charged: Array
    discharged: Array
    charge: Array


def exchange(bus: Bus, regeneration: float, base: float, joints: Array, weights: Array) -> BusFlow:
    """What flows over the bus for the joints' power (k, nq) [W] at samples in order, with quadrature weights (k,) [s].

    `regeneration` is the share of net surplus that the supply takes back. Each sample stands for an interval of the
    length of its weight, so that sums over the intervals are the quadrature's own, and no charge is lost in between.
    """
    net = weights * (base + joints.sum(axis=-1))
    if bus.mode == "isolated":
        surplus = weights * np.maximum(-joints, 0.0).sum(axis=-1)
        none = np.zeros_like(net)
        return BusFlow(net + surplus, surplus, none, none, np.zeros(len(net) + 1))
    charge = charges(bus, net, weights)
    change = np.diff(charge)
    discharged = np.maximum(-change, 0.0)
    charged = np.maximum(change, 0.0) / bus.efficiency if bus.efficiency > 0 else np.zeros_like(net)
    surplus = np.maximum(np.maximum(-net, 0.0) - charged, 0.0)  # rounding aside, charging takes no more than there is
    drawn = np.maximum(net, 0.0) - discharged - regeneration * surplus
    return BusFlow(drawn, surplus, charged, discharged, charge)


def charges(bus: Bus, net: Array, weights: Array) -> Array:
    """The store's charge (k + 1,) [J] along intervals with net demand (k,) [J] and lengths (k,) [s]; zero without."""
    if bus.mode != "storage":
        return np.zeros(len(net) + 1)
    most = bus.power * weights if np.isfinite(bus.power) else np.inf
    step = bus.efficiency * np.minimum(np.maximum(-net, 0.0), most) - np.minimum(np.maximum(net, 0.0), most)
    capacity = bus.capacity
    course = accumulate(step.tolist(), lambda charge, by: min(max(charge + by, 0.0), capacity), initial=bus.initial)
    return np.fromiter(course, dtype=float, count=len(net) + 1)


def drawn_at(bus: Bus, regeneration: float, base: float, joints: Array, charge: Array) -> Array:
    """Power drawn from the supply (k,) [W] at instants with the joints' power (k, nq) [W] and the charge (k,) [J]."""
    net = base + joints.sum(axis=-1)
    if bus.mode == "isolated":
        return np.asarray(base + np.maximum(joints, 0.0).sum(axis=-1))
    demand, surplus = np.maximum(net, 0.0), np.maximum(-net, 0.0)
    if bus.mode == "storage":
        demand = demand - np.where(charge > 0, np.minimum(demand, bus.power), 0.0)
        if bus.efficiency > 0:
            surplus = surplus - np.where(charge < bus.capacity, np.minimum(surplus, bus.power), 0.0)
    return np.asarray(demand - regeneration * surplus)
