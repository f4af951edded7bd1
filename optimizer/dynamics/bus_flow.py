"""Power on the bus: use of the joints' surplus, and the exact charge of an energy storage over
time.

P_j is the power that joint j takes from the bus, base = idle + controller, P_net = base + Σ_j P_j,
all in W.

- `shared`: drawn = max(P_net, 0) - regeneration · max(-P_net, 0). The brake resistor dissipates the
  net surplus, except for the fraction that the robot's supply takes back.
- `isolated`: drawn = base + Σ_j max(P_j, 0). Every joint dissipates its own surplus.
- `recuperating`: drawn = max(P_net, 0) - efficiency · max(-P_net, 0).
- `storage`: a capacitor or flywheel on the shared bus (Gale, Eielsen et al. 2015).

**Charging strategy.** Net surplus charges the storage and net demand discharges it, always as early
as possible. Both are limited by `power` (at the bus) and by the capacity. The loss of a round trip
is taken while charging, so that the charge E is the energy that can still be given back:

    dE/dt = efficiency · charging - discharging.

Surplus beyond these limits is treated as on the shared bus.

**Energy.** total = ∫ drawn dt + E(0) - E(T): a decrease of the charge counts as drawn. An increase
counts as given back, because the electronics use it first while they idle. With this charging
strategy,

    total = ∫ max(P_net, 0) dt - efficiency · ∫ charging dt
            - regeneration · ∫ (surplus that is not stored) dt.

Only charging saves energy, and discharging as early as possible leaves the largest free capacity
for it.

**Proof.** Let C and D be the energies charged and discharged so far by any strategy, and C* and D*
those of the strategy above. Initially C* ≥ C and D* ≥ D.

- C can overtake C* only at C = C* with the storage of the strategy above full. Then

      D* = E(0) + efficiency · C - capacity ≤ D,

  so D = D*, and the other storage is full as well.
- D can overtake D* only at D = D* with the storage of the strategy above empty. Then

      D ≤ E(0) + efficiency · C ≤ E(0) + efficiency · C* = D*,

  so the other storage is empty as well.

Neither happens, so C* ≥ C throughout.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.problem.bus import Bus


@dataclass(frozen=True)
class BusFlow:
    """Energies [J] in the intervals (k,) of the samples, and the storage's charge between the
    intervals.

    `drawn` is taken from the supply, net of the energy it takes back. `surplus` is neither used nor
    stored. `charged` goes into the storage and `discharged` comes out of it, measured at the bus.
    `charge` (k + 1,) [J] is the charge at the ends of the intervals, zero without storage.
    """

    drawn: Array
    surplus: Array
    charged: Array
    discharged: Array
    charge: Array


def exchange(bus: Bus, regeneration: float, base: float, joints: Array, weights: Array) -> BusFlow:
    """Energies on the bus for the power of the joints.

    Every sample stands for an interval as long as its quadrature weight: sums over the intervals
    equal the quadrature, and no charge is lost between them.

    Args:
        bus: the bus.
        regeneration: fraction of net surplus that the supply takes back [1].
        base: power of the electronics [W].
        joints: power of the joints (k, nq) [W] at samples in order of time.
        weights: quadrature weights of the samples (k,) [s].
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
    """Energies on a bus with exchange of power between joints, for net demand (k,) [J]; see
    `exchange` and `charges`.
    """
    charge = charges(bus, net, weights, first)
    change = np.diff(charge)
    discharged = np.maximum(-change, 0.0)
    charged = np.maximum(change, 0.0) / bus.efficiency if bus.efficiency > 0 else np.zeros_like(net)
    # Charging takes at most the surplus, except for rounding.
    surplus = np.maximum(np.maximum(-net, 0.0) - charged, 0.0)
    drawn = np.maximum(net, 0.0) - discharged - regeneration * surplus
    return BusFlow(drawn, surplus, charged, discharged, charge)


def charges(bus: Bus, net: Array, weights: Array, first: float | None = None) -> Array:
    """Charge (k + 1,) [J] of the storage at the ends of intervals; zero without storage.

    Args:
        bus: the bus.
        net: net demand (k,) [J] of the intervals.
        weights: lengths (k,) [s] of the intervals.
        first: charge at the start [J], by default the initial charge of the bus.
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
    """Change of the charge (k,) [J] in intervals as in `charges`, far from full and from empty."""
    limit = bus.power * weights if np.isfinite(bus.power) else np.inf
    return bus.efficiency * np.minimum(np.maximum(-net, 0.0), limit) - np.minimum(
        np.maximum(net, 0.0), limit
    )


def drawn_at(bus: Bus, regeneration: float, base: float, joints: Array, charge: Array) -> Array:
    """Power drawn from the supply (k,) [W] at instants.

    Args:
        bus: the bus.
        regeneration: fraction of net surplus that the supply takes back [1].
        base: power of the electronics [W].
        joints: power of the joints (k, nq) [W].
        charge: charge of the storage (k,) [J].
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
