"""The torque that the limit on torque is for: that of the motor, or that of the link behind gear
and bearings.

Makers mean one or the other: a limit of the drive holds with rotor and friction, that of a torque
sensor at the link, or of what a link bears, without them.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.losses import friction_torque
from joulepath.optimizer.problem.arm import Arm


def limited_parts(
    arm: Arm, tau: Array, v: Array, a: Array, lost: Array | None = None
) -> tuple[Array, Array]:
    """The parts (k, nq) [N·m] of the limited torque that are smooth, and the friction in it.

    `tau` is rigid body and rotor torque at speeds v [rad/s] and accelerations a [rad/s²], `lost`
    friction's torque if it is known, all (k, nq).
    """
    if arm.robot.torque_side == "link":
        return tau - arm.drives.rotor_inertia * a, np.zeros_like(tau)
    return tau, friction_torque(arm.friction_law, arm.drives, tau, v, a) if lost is None else lost


def limited_torque(arm: Arm, tau: Array, v: Array, a: Array, lost: Array | None = None) -> Array:
    """The torque (k, nq) [N·m] that the limit is for: see `limited_parts`."""
    smooth, friction = limited_parts(arm, tau, v, a, lost)
    return smooth + friction


def greatest_smooth_part(arm: Arm) -> Array:
    """The greatest absolute value (nq,) [N·m] that the smooth part of the limited torque has within
    the limits.

    Friction helps a motor that holds a load back. With f(v_max) that of an unloaded joint,
    |tau_link| ≤ |tau| + rotor · a_max, and |tau| ≤ tau_max + f + load |tau_link|:

        |tau| ≤ (tau_max + f(v_max) + load · rotor · a_max) / (1 - load).
    """
    limits, law = arm.active_limits, arm.friction_law
    if arm.robot.torque_side == "link":
        return limits.tau_max
    most: Array = limits.tau_max + law.unloaded.torque(limits.v_max)
    if law.load is None:
        return most
    return np.asarray((most + law.load * arm.drives.rotor_inertia * limits.a_max) / (1 - law.load))
