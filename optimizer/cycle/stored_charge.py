"""The charge of an energy storage over a cycle: it runs on from leg to leg, through dwells and
waits.

A step by a net surplus or demand takes a charge E to min(max(E + s, 0), capacity). One such step
after the other is again of the form min(max(E + S, low), high), with the sum S of all steps. So a
cycle that is repeated comes to a charge that it ends with as well: to that of a cycle begun full
where S > 0, to that of one begun empty where S < 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.bus_flow import BusFlow, charge_steps, charges, pooled
from joulepath.optimizer.dynamics.dwell import brake_power, holding_power, waits
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import PlannedMove


@dataclass(frozen=True)
class Demand:
    """Net demand `net` (k,) [J] on the bus in intervals of `lengths` (k,) [s], in their order."""

    net: Array
    lengths: Array

    @classmethod
    def of_motion(cls, plant: Plant, spline: Spline) -> Demand:
        """That of a motion, in the intervals of its reported energy."""
        return cls(*plant.net_demand(spline))

    @classmethod
    def of_rest(
        cls, asked: Cycle, move: PlannedMove, before: float, length: float, q: Array
    ) -> Demand:
        """That of `length` [s] of rest at q (nq,) [rad], `before` [s] after a move: by motors, then
        by brakes.
        """
        if length <= 0:
            return cls(np.zeros(0), np.zeros(0))
        arm, still = move.arm_after, np.zeros((1, len(q)))
        hold = float(holding_power(arm, Plant(arm).torques(q[None], still, still))[0])
        dwell = asked.waiting(before + length)
        done = waits(asked.waiting(before), 0.0) if before > 0 else (0.0, 0.0)
        lengths = np.array(waits(dwell, 0.0)) - done
        return cls(np.array([hold, brake_power(dwell, arm)]) * lengths, lengths)

    def flow(self, arm: Arm, first: float) -> BusFlow:
        """Where its energy comes from and goes to, with a charge `first` [J] at the start."""
        return pooled(arm.bus, arm.regeneration, self.net, self.lengths, first)


def charges_of(bus: Bus, demands: Sequence[Demand], closed: bool) -> list[float]:
    """Charge [J] of the storage before each of the demands, and after the last.

    A `closed` cycle begins with the charge that it ends with.
    """
    net, lengths = (
        np.concatenate([getattr(each, name) for each in demands]) for name in ("net", "lengths")
    )
    ends = np.cumsum([0, *(len(each.net) for each in demands)])
    first = bus.initial
    if closed:
        by = float(charge_steps(bus, net, lengths).sum())
        begun = first if by == 0 else bus.capacity if by > 0 else 0.0
        first = float(charges(bus, net, lengths, begun)[-1])
    charge = charges(bus, net, lengths, first)
    return [float(charge[k]) for k in ends]


def flows(arm: Arm, demands: Sequence[Demand], charges: Sequence[float]) -> list[BusFlow]:
    """The flow of each demand; `charges` as `charges_of` gives them."""
    return [each.flow(arm, first) for each, first in zip(demands, charges[:-1], strict=True)]


def drawn(arm: Arm, demands: Sequence[Demand], charges: Sequence[float]) -> float:
    """Energy [J] that demands draw, the decrease of the charge included."""
    return (
        sum(float(each.drawn.sum()) for each in flows(arm, demands, charges))
        + charges[0]
        - charges[-1]
    )
