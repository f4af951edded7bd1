"""Energy drawn while the arm waits at the goal until its dwell ends.

After Meike, Ribickis 2011; Meike, Pellicciari, Berselli 2014. The motors hold the gravity torque of
the goal configuration; static friction would carry part of it and is ignored. With the duration T
[s] of the motion:

    P_hold   = base + Σ_j (copper_j i_j² + inverter_j(i_j)) [W],  i = tau_gravity / torque_constant
    dwell(T) = P_hold · min(time - T, brake_delay) + P_brake · max(time - T - brake_delay, 0) [J]

Without brakes the delay is infinite. So dwell(T) is linear on both sides of T = time - brake_delay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.losses import power_flow
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.result.energy import Energy


@dataclass(frozen=True)
class LinearDwell:
    """dwell(T) = constant - power · T [J] for durations T in [t_min, t_max] [s].

    `power` (...) [W] and `constant` (...) [J] have one value per holding power.
    """

    t_min: float
    t_max: float
    power: Array
    constant: Array

    @staticmethod
    def none() -> LinearDwell:
        """No wait after a motion of any duration."""
        return LinearDwell(0.0, np.inf, np.zeros(1), np.zeros(1))


def linear_dwells(dwell: Dwell, arm: Arm, hold: Array) -> list[LinearDwell]:
    """Intervals of [0, dwell.time] on which dwell(T) is linear, in order, for holding powers `hold`
    (...) [W].
    """
    if dwell.hold == "motors":
        return [LinearDwell(0.0, dwell.time, hold, hold * dwell.time)]
    brake, kink = np.full_like(hold, brake_power(dwell, arm)), dwell.time - dwell.brake_delay
    early = LinearDwell(0.0, kink, brake, hold * dwell.brake_delay + brake * kink)
    late = LinearDwell(max(kink, 0.0), dwell.time, hold, hold * dwell.time)
    return [interval for interval in (early, late) if interval.t_max > interval.t_min]


def dwell_energy(dwell: Dwell, arm: Arm, hold: float, duration: float) -> float:
    """Energy [J] drawn after a motion of `duration` [s] at a goal with holding power `hold` [W].

    It is zero if the motion lasts for the whole dwell.
    """
    by_motors, by_brakes = holding_times(dwell, duration)
    return hold * by_motors + brake_power(dwell, arm) * by_brakes


def with_dwell(energy: Energy, dwell: Dwell, arm: Arm, hold: float, duration: float) -> Energy:
    """The energy of a motion of `duration` [s] with that of the dwell after it, at a goal with
    holding power `hold` [W]."""
    drawn, mains = dwell_energy(dwell, arm, hold, duration), arm.robot.mains
    wait = sum(holding_times(dwell, duration))
    return energy.with_dwell(drawn, 0.0 if mains is None else mains.energy(drawn, wait))


def holding_times(dwell: Dwell, duration: float) -> tuple[float, float]:
    """Times [s] for which first the motors and then the brakes hold the arm after a motion of
    `duration` [s].
    """
    wait = max(dwell.time - duration, 0.0)
    by_motors = wait if dwell.hold == "motors" else min(wait, dwell.brake_delay)
    return by_motors, wait - by_motors


def holding_power(arm: Arm, tau: Array) -> Array:
    """Power (...) [W] that the arm draws at standstill while its motors hold torques tau (..., nq)
    [N·m].
    """
    still = np.zeros_like(tau)
    joints = power_flow(tau, still, still, arm.drives, arm.friction_law).joints
    return np.asarray(arm.base_power + joints.sum(axis=-1))


def brake_power(dwell: Dwell, arm: Arm) -> float:
    """Total power [W] that the arm draws while its brakes hold it."""
    return arm.base_power if dwell.brake_power is None else dwell.brake_power
