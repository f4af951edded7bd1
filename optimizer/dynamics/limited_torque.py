"""The torque to which the torque limit applies: at the motor, or at the link behind gear and
bearings.

Manufacturers differ: a limit of the drive includes rotor and friction; a limit of a torque sensor
at the link, or of the strength of the link, does not.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.losses import friction_torque
from joulepath.optimizer.problem.arm import Arm


def limited_parts(
    arm: Arm, tau: Array, v: Array, a: Array, tau_friction: Array | None = None
) -> tuple[Array, Array]:
    """Smooth part of the limited torque, and the friction in it, (k, nq) [N·m] each.

    Args:
        arm: the arm.
        tau: rigid-body and rotor torques (k, nq) [N·m].
        v: joint speeds (k, nq) [rad/s].
        a: joint accelerations (k, nq) [rad/s²].
        tau_friction: friction torques (k, nq) [N·m] if they are known already.
    """
    if arm.robot.torque_side == "link":
        return tau - arm.drives.rotor_inertia * a, np.zeros_like(tau)
    return tau, friction_torque(
        arm.friction_law, arm.drives, tau, v, a
    ) if tau_friction is None else tau_friction


def limited_torque(
    arm: Arm, tau: Array, v: Array, a: Array, tau_friction: Array | None = None
) -> Array:
    """Torque (k, nq) [N·m] to which the limit applies, the sum of `limited_parts`."""
    smooth, friction = limited_parts(arm, tau, v, a, tau_friction)
    return smooth + friction


def greatest_smooth_part(arm: Arm) -> Array:
    """Upper bound (nq,) [N·m] on the smooth part of the limited torque of motions within the
    limits.

    Friction helps a motor to hold back a load. With the friction f(v_max) of an unloaded joint,
    |tau_link| ≤ |tau| + rotor · a_max and |tau| ≤ tau_max + f + load |tau_link|, hence

        |tau| ≤ (tau_max + f(v_max) + load · rotor · a_max) / (1 - load).
    """
    limits, law = arm.active_limits, arm.friction_law
    if arm.robot.torque_side == "link":
        return limits.tau_max
    most: Array = limits.tau_max + law.unloaded.torque(limits.v_max)
    if law.load is None:
        return most
    return np.asarray((most + law.load * arm.drives.rotor_inertia * limits.a_max) / (1 - law.load))
