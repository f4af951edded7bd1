"""Waiting after the motion until the cycle is over: with the motors on, or on the brakes (Meike, Ribickis 2011; Meike,
Pellicciari, Berselli 2014).

Motors hold the goal's gravity torque alone (friction, which would help, is ignored):

P_hold  = base + Σ_j (copper_j i_j² + inverter_j(i_j)),  i = tau_gravity / torque_constant
dwell(T) = P_hold · min(time - T, brake_delay) + P_brake · max(time - T - brake_delay, 0)

With the motors alone the delay is without end. So dwell is linear in T on either side of time - brake_delay.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.robot import Array
from optimizer.arm import Arm
from optimizer.energy import power_flow
from optimizer.exceptions import InvalidProblem

Hold = Literal["motors", "brakes"]


@dataclass(frozen=True)
class Waiting:
    """dwell(T) = constant - power · T for durations T in [t_min, t_max]; s, J, W."""

    t_min: float
    t_max: float
    power: Array
    constant: Array


@dataclass(frozen=True)
class Cycle:
    """The time [s] from the motion's start until the arm is needed again, and how the arm holds still until then.

    On brakes the motors hold for `brake_delay` [s] first; then the arm draws `brake_power` [W] in all, electronics
    included (None: what the electronics draw, brakes on).

    Raises InvalidProblem, with the field named.
    """

    time: float
    hold: Hold = "motors"
    brake_delay: float = 0.0
    brake_power: float | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.time) and self.time > 0):
            raise InvalidProblem("cycle.time", "cycle.time must be a positive number of seconds.")
        if self.hold not in ("motors", "brakes"):
            raise InvalidProblem("cycle.hold", "cycle.hold must be motors or brakes.")
        if not (np.isfinite(self.brake_delay) and self.brake_delay >= 0):
            raise InvalidProblem("cycle.brake_delay", "cycle.brake_delay must be a number of seconds, zero or more.")
        if self.brake_power is not None and not (np.isfinite(self.brake_power) and self.brake_power >= 0):
            raise InvalidProblem("cycle.brake_power", "cycle.brake_power must be a number of watts, zero or more.")

    def pieces(self, arm: Arm, hold: Array) -> list[Waiting]:
        """The linear pieces of dwell(T) from T = 0 to `time`, for holding powers `hold` (...) [W]."""
        if self.hold == "motors":
            return [Waiting(0.0, self.time, hold, hold * self.time)]
        brake, kink = np.full_like(hold, self._brake_power(arm)), self.time - self.brake_delay
        early = Waiting(0.0, kink, brake, hold * self.brake_delay + brake * kink)
        late = Waiting(max(kink, 0.0), self.time, hold, hold * self.time)
        return [piece for piece in (early, late) if piece.t_max > piece.t_min]

    def dwell(self, arm: Arm, hold: float, duration: float) -> float:
        """Energy [J] drawn after a motion of `duration` [s]; none where it takes all of the cycle, or more."""
        rest = max(self.time - duration, 0.0)
        by_motors = rest if self.hold == "motors" else min(rest, self.brake_delay)
        return hold * by_motors + self._brake_power(arm) * (rest - by_motors)

    def _brake_power(self, arm: Arm) -> float:
        return arm.base_power if self.brake_power is None else self.brake_power


def holding_power(arm: Arm, tau: Array) -> Array:
    """What the arm draws (...) [W] while its motors hold torques tau (..., nq) [N·m] at rest."""
    joints = power_flow(tau, np.zeros_like(tau), arm.drives, arm.friction_law).joints
    return np.asarray(arm.base_power + joints.sum(axis=-1))
