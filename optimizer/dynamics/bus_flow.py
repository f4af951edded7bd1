"""Power on the bus: where the joints' surplus goes, and the exact charge of an energy storage over
time.

P_j is the power that joint j takes from the bus, base = idle + controller, P_net = base + Σ_j P_j,
all in W.

- `shared`        drawn = max(P_net, 0) - regeneration · max(-P_net, 0): the brake resistor
  dissipates the net surplus,
                  except for the fraction that the robot's supply takes back
- `isolated`      drawn = base + Σ_j max(P_j, 0): every joint dissipates its own surplus
- `recuperating`  drawn = max(P_net, 0) - efficiency · max(-P_net, 0)
- `storage`       a capacitor or flywheel on the shared bus (Gale, Eielsen et al. 2015)

**Charging strategy.** Net surplus charges the storage and net demand discharges it, always as early
  as possible. Both
are limited by `power` (at the bus) and by the capacity. The loss of a round trip is taken while
charging, so that the
charge E is the energy that can still be given back: dE/dt = efficiency · charging - discharging.
Surplus that exceeds
these limits is treated as on the shared bus.

**Energy.** total = ∫ drawn dt + E(0) - E(T): a decrease of the charge counts as if it were drawn.
  An increase counts as
if it were given back, because the electronics use it first while they idle. With the charging
strategy put in,

    total = ∫ max(P_net, 0) dt - efficiency · ∫ charging dt - (regenerated part of the surplus that
    is not stored).

Only charging saves energy, and discharging as early as possible leaves the largest free capacity
for it. Proof: let C, D be the energy charged and discharged so far by any strategy, and C*, D* by
this one. While C* ≥ C and D* ≥ D hold, C can overtake only at C = C* with this storage full. Then
D* = E(0) + efficiency · C - capacity ≤ D, so D = D*, and the other storage is full as well. D can
overtake only at D = D* with this storage empty. Then D ≤ E(0) + efficiency · C ≤ E(0) + efficiency
· C* = D*, so the other storage is empty as well. Neither happens, so C* ≥ C throughout.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.problem.bus import Bus


@dataclass(frozen=True)
class BusFlow:
    """Energies [J] in the intervals (k,) that the samples stand for, and the storage's charge
    between them.

    `drawn` from the supply, net of what it takes back; `surplus` that is neither used nor stored;
    `charged` into and `discharged` from the storage, at the bus. `charge` (k + 1,) [J] at the ends
    of the intervals, zero without storage.
    """

    drawn: Array
    surplus: Array
    charged: Array
    discharged: Array
    charge: Array


def exchange(bus: Bus, regeneration: float, base: float, joints: Array, weights: Array) -> BusFlow:
    """Energies on the bus for the joints' power (k, nq) [W] at samples in order of time, with
    weights (k,) [s].

    `regeneration` [1] is the fraction of net surplus that the supply takes back, `base` [W] the
    electronics' power. Every sample stands for an interval as long as its quadrature weight: sums
    over the intervals are the quadrature's, and no charge is lost between them.
    """
    net = weights * (base + joints.sum(axis=-1))
    if bus.mode == "isolated":
        surplus = weights * np.maximum(-joints, 0.0).sum(axis=-1)
        none = np.zeros_like(net)
        return BusFlow(net + surplus, surplus, none, none, np.zeros(len(net) + 1))
    return pooled(bus, regeneration, net, weights)


def pooled(
    bus: Bus, regeneration: float, net: Array, weights: Array, first: float | None = None
) -> BusFlow:
    """Energies on a bus whose joints exchange power, for net demand (k,) [J]; see `exchange` and
    `charges`.
    """
    charge = charges(bus, net, weights, first)
    change = np.diff(charge)
    discharged = np.maximum(-change, 0.0)
    charged = np.maximum(change, 0.0) / bus.efficiency if bus.efficiency > 0 else np.zeros_like(net)
    # charging takes no more than the surplus, except for rounding
    surplus = np.maximum(np.maximum(-net, 0.0) - charged, 0.0)
    drawn = np.maximum(net, 0.0) - discharged - regeneration * surplus
    return BusFlow(drawn, surplus, charged, discharged, charge)


def charges(bus: Bus, net: Array, weights: Array, first: float | None = None) -> Array:
    """Charge (k + 1,) [J] of the storage at the ends of intervals with net demand (k,) [J] and
    lengths (k,) [s].

    It is `first` at the start, unless given the initial one. Zero without storage.
    """
    if bus.mode != "storage":
        return np.zeros(len(net) + 1)
    step, capacity = charge_steps(bus, net, weights), bus.capacity
    first = bus.initial if first is None else first
    charge = accumulate(
        step.tolist(), lambda charge, by: min(max(charge + by, 0.0), capacity), initial=first
    )
    return np.fromiter(charge, dtype=float, count=len(net) + 1)


def charge_steps(bus: Bus, net: Array, weights: Array) -> Array:
    """By how much (k,) [J] the charge would change in intervals as in `charges`, far from full and
    empty.
    """
    limit = bus.power * weights if np.isfinite(bus.power) else np.inf
    return bus.efficiency * np.minimum(np.maximum(-net, 0.0), limit) - np.minimum(
        np.maximum(net, 0.0), limit
    )


def drawn_at(bus: Bus, regeneration: float, base: float, joints: Array, charge: Array) -> Array:
    """Power drawn from the supply (k,) [W] at instants with the joints' power (k, nq) [W] and the
    charge (k,) [J].

    `regeneration` [1] is the fraction of net surplus that the supply takes back, `base` [W] the
    electronics' power.
    """
    net = base + joints.sum(axis=-1)
    if bus.mode == "isolated":
        return np.asarray(base + np.maximum(joints, 0.0).sum(axis=-1))
    demand, surplus = np.maximum(net, 0.0), np.maximum(-net, 0.0)
    if bus.mode == "storage":
        demand = demand - np.where(charge > 0, np.minimum(demand, bus.power), 0.0)
        if bus.efficiency > 0:
            surplus = surplus - np.where(charge < bus.capacity, np.minimum(surplus, bus.power), 0.0)
    return np.asarray(demand - regeneration * surplus)
