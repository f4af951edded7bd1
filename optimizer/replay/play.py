"""Simulation of one motion under one controller in MuJoCo, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.declared import Metres, Seconds
from joulepath.optimizer.replay.controller import Command
from joulepath.optimizer.replay.reference import Reference
from joulepath.optimizer.replay.simulated_arm import SimulatedArm
from joulepath.optimizer.replay.simulator import mujoco


@dataclass(frozen=True)
class PlaySettings:
    """Settings of the simulation."""

    steps_per_check: int = 512
    """Steps between two checks of the deadline: some ten milliseconds."""


PLAY = PlaySettings()


@dataclass(frozen=True)
class Contact:
    """The deepest contact of two bodies."""

    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles."""
    depth: Metres
    """Depth of their overlap."""
    time: Seconds
    """Time, from the start of the motion."""


@dataclass(frozen=True)
class Played:
    """Motion of the simulated arm at n instants."""

    step: float
    """Time between two instants [s]."""
    q: Array
    """Positions (n, nq) [rad]."""
    v: Array
    """Velocities (n, nq) [rad/s]."""
    a: Array
    """Accelerations (n, nq) [rad/s²]."""
    tau_motor: Array
    """Torques of the motors (n, nq) [N·m]."""
    saturated: Mask
    """Whether a torque was clipped to its limit (n, nq)."""
    contact: Contact | None
    """The deepest contact; None if there was none."""


def play(simulated: SimulatedArm, motion: Reference, commanded: Command) -> Played:
    """Simulate a motion from its start under a command.

    Args:
        simulated: the simulated arm.
        motion: the motion to follow.
        commanded: torques of the controller.

    Raises:
        DeadlinePassed: the watched deadline passed.
    """
    step_on, model, data = mujoco().mj_step, simulated.model, simulated.data
    stiffness, damping = commanded.gains.stiffness, commanded.gains.damping
    q, torque, speeds = (
        np.empty_like(motion.q),
        np.empty_like(motion.q),
        np.empty((len(motion.q) + 1, model.nv)),
    )
    mujoco().mj_resetData(model, data)
    model.opt.timestep = motion.step
    rotors = simulated.arm.drives.rotor_inertia
    model.dof_damping[:] = 0.0
    data.qpos[:], data.qvel[:] = motion.q[0], motion.v_before[0]
    position, speed, applied = data.qpos, data.qvel, data.qfrc_applied
    speeds[0], deepest = speed, None
    steps_per_check = PLAY.steps_per_check
    for k in range(len(q)):
        if k % steps_per_check == 0:
            checkpoint()
        q[k] = position
        wanted = commanded.torque[k] - stiffness * position - damping * speed
        torque[k] = np.minimum(np.maximum(wanted, commanded.lowest[k]), commanded.highest[k])
        applied[:] = torque[k]
        # torque that the joints carried in the previous step, on which friction may depend
        carried = (
            torque[k]
            - model.dof_damping * speed
            - rotors * (speeds[k] - speeds[max(k - 1, 0)]) / motion.step
        )
        simulated.set_friction(2 * speeds[k] - speeds[max(k - 1, 0)], carried)
        step_on(model, data)
        speeds[k + 1] = speed
        if data.ncon:
            deepest = _deeper(deepest, simulated, k * motion.step)
    return Played(
        step=motion.step,
        q=q,
        v=(speeds[1:] + speeds[:-1]) / 2,
        a=np.diff(speeds, axis=0) / motion.step,
        tau_motor=torque,
        saturated=(torque <= commanded.lowest) | (torque >= commanded.highest),
        contact=deepest,
    )


def _deeper(known: Contact | None, simulated: SimulatedArm, time: float) -> Contact | None:
    """The deepest of a known contact and the contacts of this instant."""
    found = simulated.data.contact
    k = int(np.argmin(found.dist))
    depth = -float(found.dist[k])
    if depth <= (0.0 if known is None else known.depth):
        return known
    first, second = found.geom[k].tolist()
    return Contact((simulated.bodies[first], simulated.bodies[second]), depth, time)
