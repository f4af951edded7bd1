"""The torque that the limit on torque is for: that of the motor, or that of the link behind gear and bearings.

Makers mean one or the other: a limit of the drive holds with rotor and friction, that of a torque sensor at the link,
or of what a link bears, without them.
"""

from __future__ import annotations

import numpy as np

from models.robot import Array
from optimizer.problem.arm import Arm


def limited_parts(arm: Arm, tau: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """The parts (k, nq) [N·m] of the limited torque that are smooth, and the friction in it.

    `tau` is rigid body and rotor torque at speeds v [rad/s] and accelerations a [rad/s²], all (k, nq).
    """
    if arm.robot.torque_side == "link":
        return tau - arm.drives.rotor_inertia * a, np.zeros_like(tau)
    return tau, arm.friction_law.torque(v)


def limited_torque(arm: Arm, tau: Array, v: Array, a: Array) -> Array:
    """The torque (k, nq) [N·m] that the limit is for: see `limited_parts`."""
    smooth, friction = limited_parts(arm, tau, v, a)
    return smooth + friction
