"""One motion under one controller, played in MuJoCo step by step."""

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

# steps between two looks at the deadline: some ten milliseconds
STEPS_PER_CHECK = 512


@dataclass(frozen=True)
class Contact:
    """The deepest contact of two bodies."""

    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles."""
    depth: Metres
    """How deep they go into each other."""
    time: Seconds
    """Time, from the start of the motion."""


@dataclass(frozen=True)
class Played:
    """What the simulated arm did at n instants, `step` [s] apart.

    q [rad], v [rad/s], a [rad/s²], torque of the motors [N·m], (n, nq) each; `saturated` (n, nq)
    where this was cut to its limit. The `contact` is None if there was none.
    """

    step: float
    q: Array
    v: Array
    a: Array
    tau_motor: Array
    saturated: Mask
    contact: Contact | None


def play(simulated: SimulatedArm, motion: Reference, asked: Command) -> Played:
    """What the simulated arm does from the start of a motion on, under a command.

    Ends by DeadlinePassed if the watched deadline passes.
    """
    step_on, model, data = mujoco().mj_step, simulated.model, simulated.data
    stiffness, damping = asked.gains.stiffness, asked.gains.damping
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
    for k in range(len(q)):
        if k % STEPS_PER_CHECK == 0:
            checkpoint()
        q[k] = position
        wanted = asked.torque[k] - stiffness * position - damping * speed
        torque[k] = np.minimum(np.maximum(wanted, asked.lowest[k]), asked.highest[k])
        applied[:] = torque[k]
        # what the joints carried in the step before: friction may depend on it
        carried = (
            torque[k]
            - model.dof_damping * speed
            - rotors * (speeds[k] - speeds[max(k - 1, 0)]) / motion.step
        )
        simulated.rub(2 * speeds[k] - speeds[max(k - 1, 0)], carried)
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
        saturated=(torque <= asked.lowest) | (torque >= asked.highest),
        contact=deepest,
    )


def _deeper(known: Contact | None, simulated: SimulatedArm, time: float) -> Contact | None:
    """The deeper one of a contact and those of this instant."""
    found = simulated.data.contact
    k = int(np.argmin(found.dist))
    depth = -float(found.dist[k])
    if depth <= (0.0 if known is None else known.depth):
        return known
    first, second = found.geom[k].tolist()
    return Contact((simulated.bodies[first], simulated.bodies[second]), depth, time)
