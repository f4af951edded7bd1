"""Measured energy of the segments of a log."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.declared import Joules
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class MeasuredEnergy:
    """Measured electrical energy during a part of a log."""

    electrical: Joules | None
    """Integral of the logged power of the arm's bus. Null if the log has none."""
    by_efforts: Joules | None
    """Integral of the power that the motors take by their logged currents or torques, with the
    losses of the robot's drives and its idle power, and with the robot's friction and rotors if the
    torques were measured behind the gears. Null if the log has none."""

    @property
    def best(self) -> float | None:
        """The energy by the logged power, or else by the efforts [J]."""
        return self.by_efforts if self.electrical is None else self.electrical

    def joined(self, other: MeasuredEnergy) -> MeasuredEnergy:
        """The energies of two parts together."""
        return MeasuredEnergy(
            _sum(self.electrical, other.electrical), _sum(self.by_efforts, other.by_efforts)
        )


def measured(log: Log, arm: Arm) -> list[MeasuredEnergy]:
    """Integrate the measured power over the segments of a log.

    Args:
        log: the log.
        arm: the arm, for its drives and, with torques measured behind the gears, its friction.

    Returns:
        Energy of each segment of `log.recording()`; empty without logged power and efforts.
    """
    drives = arm.drives
    torque = None
    if log.effort is not None and log.effort_meaning != "external" and log.has_all_efforts:
        torque = log.effort * (drives.torque_constant if log.effort_meaning == "current" else 1.0)
    if torque is None and log.power is None:
        return []
    plant, found = Plant(arm), list[MeasuredEnergy]()
    for first, last in pairwise(log.segment_rows):
        parts = [
            _part(log, plant, torque, slice(low, high + 1)) for low, high in _pieces(first, last)
        ]
        whole = parts[0]
        for part in parts[1:]:
            whole = whole.joined(part)
        found.append(whole)
    return found


def _part(log: Log, plant: Plant, torque: Array | None, rows: slice) -> MeasuredEnergy:
    time = log.time[rows]
    weights = np.zeros(len(time))
    weights[:-1] += np.diff(time) / 2
    weights[1:] += np.diff(time) / 2
    drawn = None if log.power is None else float(weights @ log.power[rows])
    if torque is None:
        return MeasuredEnergy(drawn, None)
    q, v, a = (channel[rows].astype(float) for channel in (log.q, log.v, log.a))
    tau, motor = plant.torques(q, v, a), torque[rows]
    if log.torque_side == "link":
        motor = motor + plant.arm.drives.rotor_inertia * a + plant.friction.torque(v, motor)
    # the excess of the measured torque over the rigid-body torque counts as loss
    energy = breakdown(weights, v, a, tau, 0.0, plant.arm, tau_friction=motor - tau)
    return MeasuredEnergy(drawn, energy.electrical.total)


def _pieces(first: int, last: int) -> Iterator[tuple[int, int]]:
    """Ranges of limited size, to bound the memory for long logs."""
    return pairwise([*range(first, last, MOTION_LIMITS.block_rows), last])


def _sum(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else one + other
