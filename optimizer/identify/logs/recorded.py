"""The energy that was measured in each segment of a log."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.energy.losses import breakdown
from joulepath.optimizer.energy.plant import Plant
from joulepath.optimizer.evaluate.recording import BLOCK
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class Measured:
    """Electrical energies of a part of a log [J], None where the log has no such channel.

    `electrical` is the integral of the logged power. `by_efforts` is that of the power which the motors' logged
    currents or torques take by the figures of the arm's drives, with its idle power.
    """

    electrical: float | None
    by_efforts: float | None

    def joined(self, other: Measured) -> Measured:
        """The energies of two parts together."""
        return Measured(_sum(self.electrical, other.electrical), _sum(self.by_efforts, other.by_efforts))


def measured(log: Log, arm: Arm) -> list[Measured]:
    """What was measured in each segment of `log.recording()` of `arm`; empty if nothing was."""
    drives = arm.drives
    torque = None
    if log.effort is not None and log.effort_meaning != "external":
        torque = log.effort * (drives.torque_constant if log.effort_meaning == "current" else 1.0)
    if torque is None and log.power is None:
        return []
    plant, found = Plant(arm), list[Measured]()
    for first, last in pairwise(log.segment_rows):
        parts = [_part(log, plant, torque, slice(low, high + 1)) for low, high in _pieces(first, last)]
        whole = parts[0]
        for part in parts[1:]:
            whole = whole.joined(part)
        found.append(whole)
    return found


def _part(log: Log, plant: Plant, torque: Array | None, rows: slice) -> Measured:
    time = log.time[rows]
    weights = np.zeros(len(time))
    weights[:-1] += np.diff(time) / 2
    weights[1:] += np.diff(time) / 2
    drawn = None if log.power is None else float(weights @ log.power[rows])
    if torque is None:
        return Measured(drawn, None)
    q, v, a = (channel[rows].astype(float) for channel in (log.q, log.v, log.a))
    tau = plant.torques(q, v, a)
    # what is left of the measured torque when the motion is made is lost
    energy = breakdown(weights, v, a, tau, 0.0, plant.arm, lost=torque[rows] - tau)
    return Measured(drawn, energy.electrical.total)


def _pieces(first: int, last: int) -> Iterator[tuple[int, int]]:
    """Rows from `first` to `last` in pieces of BLOCK rows at most, so that memory does not grow with a log's length."""
    return pairwise([*range(first, last, BLOCK), last])


def _sum(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else one + other
