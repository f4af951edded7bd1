"""Charge of an energy storage over a cycle, through moves, dwells and waits.

A net surplus or demand s takes a charge E to min(max(E + s, 0), capacity). A sequence of such steps
has the form min(max(E + S, low), high) with the sum S of all steps. A repeated cycle therefore
converges to a charge with which it also ends: the final charge of a cycle that starts full if S >
0, or empty if S < 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.bus_flow import BusFlow, charge_steps, charges, pooled
from joulepath.optimizer.dynamics.dwell import brake_power, holding_times
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import PlannedMove


@dataclass(frozen=True)
class Demand:
    """Net demand on the bus.

    Attributes:
        net: demand in successive intervals, shape (k,) [J].
        lengths: durations of the intervals, shape (k,) [s].
    """

    net: Array
    lengths: Array

    @classmethod
    def of_motion(cls, plant: Plant, spline: Spline) -> Demand:
        """Demand of a motion, in the intervals of its reported energy."""
        return cls(*plant.net_demand(spline))

    @classmethod
    def of_rest(
        cls, cycle: Cycle, move: PlannedMove, before: float, length: float, q: Array
    ) -> Demand:
        """Demand of a rest: on motors first, then on brakes.

        Args:
            cycle: the cycle.
            move: move before the rest.
            before: time since the end of the move [s].
            length: duration of the rest [s].
            q: joint positions, shape (nq,) [rad].
        """
        if length <= 0:
            return cls(np.zeros(0), np.zeros(0))
        arm = move.arm_after
        hold = float(Plant(arm).holding_power(q))
        dwell = cycle.dwell_of(before + length)
        done = holding_times(cycle.dwell_of(before), 0.0) if before > 0 else (0.0, 0.0)
        lengths = np.array(holding_times(dwell, 0.0)) - done
        return cls(np.array([hold, brake_power(dwell, arm)]) * lengths, lengths)

    def flow(self, arm: Arm, first: float) -> BusFlow:
        """Sources and sinks of the energy, with the charge `first` [J] at the start."""
        return pooled(arm.bus, arm.regeneration, self.net, self.lengths, first)


def charges_of(bus: Bus, demands: Sequence[Demand], closed: bool) -> list[float]:
    """Charge [J] of the storage before every demand, and after the last one.

    A closed cycle begins with the charge with which it ends.
    """
    net, lengths = (
        np.concatenate([getattr(each, name) for each in demands]) for name in ("net", "lengths")
    )
    ends = np.cumsum([0, *(len(each.net) for each in demands)])
    first = bus.initial
    if closed:
        net_charge = float(charge_steps(bus, net, lengths).sum())
        assumed = first if net_charge == 0 else bus.capacity if net_charge > 0 else 0.0
        first = float(charges(bus, net, lengths, assumed)[-1])
    charge = charges(bus, net, lengths, first)
    return [float(charge[k]) for k in ends]


def flows(arm: Arm, demands: Sequence[Demand], charges: Sequence[float]) -> list[BusFlow]:
    """Flow of every demand; `charges` as returned by `charges_of`."""
    return [each.flow(arm, first) for each, first in zip(demands, charges[:-1], strict=True)]


def drawn(arm: Arm, demands: Sequence[Demand], charges: Sequence[float]) -> float:
    """Energy [J] drawn by demands, including the decrease of the charge."""
    return (
        sum(float(each.drawn.sum()) for each in flows(arm, demands, charges))
        + charges[0]
        - charges[-1]
    )
