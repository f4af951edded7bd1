"""Controllers of a replay: a PD loop, with torques known in advance or alone."""

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


@dataclass(frozen=True)
class ControllerSettings:
    """Settings of the PD loop.

    The defaults give some 2000 N·m/rad and 400 N·m·s/rad for the large joints of an arm for 5 kg,
    and 400 and 80 for its wrist.
    """

    full_torque_error: float = 0.07
    """Position error for which the loop commands the whole torque of a joint [rad]."""
    damping_time: float = 0.2
    """Damping over stiffness [s]."""
    max_damping: float = 0.25
    """Largest share of a joint's speed error removed per step [1]; a loop is unstable from twice
    the error on."""


CONTROLLER = ControllerSettings()


@dataclass(frozen=True)
class Gains:
    """Gains of the PD loop per joint (nq,): stiffness [N·m/rad] and damping [N·m·s/rad]."""

    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class Command:
    """Torques per step: `torque` - stiffness · q - damping · v, clipped to two bounds.

    Attributes:
        torque: constant part of the torques (n, nq) [N·m].
        lowest: lower bounds (n, nq) by the torque limits, on the side of the motor [N·m].
        highest: upper bounds (n, nq) [N·m].
        gains: gains of the loop.
    """

    torque: Array
    lowest: Array
    highest: Array
    gains: Gains


def gains(plant: Plant, q: Array, step: float) -> Gains:
    """Gains of the PD loop, proportional to the torque limits.

    The damping is smaller where the inertia of a joint is too small for the step.

    Args:
        plant: dynamics of the arm.
        q: configuration at the start (nq,) [rad].
        step: period of the controller [s].
    """
    arm, model = plant.arm, plant.model
    inertia = (
        pin.crba(model, model.createData(), q).diagonal()
        - model.armature
        + arm.drives.rotor_inertia
    )
    stiffness = arm.active_limits.tau_max / CONTROLLER.full_torque_error
    return Gains(
        stiffness,
        np.minimum(stiffness * CONTROLLER.damping_time, CONTROLLER.max_damping * inertia / step),
    )


def command(plant: Plant, motion: Reference, control: ControlName, loop: Gains) -> Command:
    """Commands of a controller along a motion.

    Args:
        plant: dynamics of the arm that the controller knows, which may differ from the simulated
            arm.
        motion: the motion.
        control: the controller.
        loop: gains of the PD loop.
    """
    arm = plant.arm
    torque = loop.stiffness * motion.q + loop.damping * motion.v_before
    if control == "feed_forward":
        tau = plant.torques(motion.q, motion.v, motion.a)
        torque += tau + friction_torque(arm.friction_law, arm.drives, tau, motion.v, motion.a)
    most, shift = arm.active_limits.tau_max, _between_motor_and_limit(plant, motion)
    return Command(torque, shift - most, shift + most, loop)


def _between_motor_and_limit(plant: Plant, motion: Reference) -> Array:
    """Torque (n, nq) [N·m] between the motor and the side of the joint with the torque limit."""
    arm = plant.arm
    if arm.robot.torque_side == "motor":
        return np.zeros_like(motion.v)
    tau = plant.torques(motion.q, motion.v, motion.a)
    tau_friction = friction_torque(arm.friction_law, arm.drives, tau, motion.v, motion.a)
    return np.asarray(arm.drives.rotor_inertia * motion.a + tau_friction)
