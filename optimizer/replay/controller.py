"""The controllers under which a motion is played: torques known in advance with a PD loop, or the
loop alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.losses import friction_torque
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.replay.reference import Reference

ControlName = Literal["feed_forward", "pd"]
# error [rad] at which the loop asks for the whole torque of a joint, and the time [s] over which it
# looks ahead: some 2000 N·m/rad and 400 N·m·s/rad for the large joints of an arm of 5 kg, 400 and
# 80 for its wrist
FULL_TORQUE, LOOK_AHEAD = 0.07, 0.2
# greatest part of a joint's speed error that one step takes away; from twice the error on, a loop
# is unstable
MOST_DAMPING = 0.25


@dataclass(frozen=True)
class Gains:
    """Gains of the PD loop per joint (nq,): stiffness [N·m/rad] and damping [N·m·s/rad]."""

    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class Command:
    """Torques [N·m] per step: `torque` (n, nq) - stiffness · q - damping · v, then cut to between
    the two bounds.

    The bounds (n, nq) are the torque limits on the side of the motor.
    """

    torque: Array
    lowest: Array
    highest: Array
    gains: Gains


def gains(plant: Plant, q: Array, step: float) -> Gains:
    """Gains of the PD loop that starts at q (nq,) [rad] and looks at the arm every `step` [s].

    They are in proportion to the torque limits. The damping is less where the joint's inertia is
    too small for the step.
    """
    arm, model = plant.arm, plant.model
    inertia = (
        pin.crba(model, model.createData(), q).diagonal()
        - model.armature
        + arm.drives.rotor_inertia
    )
    stiffness = arm.active_limits.tau_max / FULL_TORQUE
    return Gains(stiffness, np.minimum(stiffness * LOOK_AHEAD, MOST_DAMPING * inertia / step))


def command(plant: Plant, motion: Reference, control: ControlName, loop: Gains) -> Command:
    """What a controller asks for along a motion; it knows the arm of `plant`, which may not be the
    one that moves.
    """
    arm = plant.arm
    torque = loop.stiffness * motion.q + loop.damping * motion.v_before
    if control == "feed_forward":
        tau = plant.torques(motion.q, motion.v, motion.a)
        torque += tau + friction_torque(arm.friction_law, arm.drives, tau, motion.v, motion.a)
    most, shift = arm.active_limits.tau_max, _between_motor_and_limit(plant, motion)
    return Command(torque, shift - most, shift + most, loop)


def _between_motor_and_limit(plant: Plant, motion: Reference) -> Array:
    """Torque [N·m] between the motor and the side of the joint that its limit is for."""
    arm = plant.arm
    if arm.robot.torque_side == "motor":
        return np.zeros_like(motion.v)
    tau = plant.torques(motion.q, motion.v, motion.a)
    lost = friction_torque(arm.friction_law, arm.drives, tau, motion.v, motion.a)
    return np.asarray(arm.drives.rotor_inertia * motion.a + lost)
