"""What a played motion amounts to: how far it went off, its torques, energy and contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.energy.limited_torque import limited_torque
from joulepath.optimizer.energy.losses import breakdown, friction_torque
from joulepath.optimizer.energy.plant import Plant
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.replay.play import Contact, Played
from joulepath.optimizer.replay.reference import Reference
from joulepath.optimizer.result.energy import Energy

# depth [m] of a contact that no good tracking explains: motions may be planned closer than any controller follows them
TOUCH = 2.5e-4
# rounds in which friction that grows with the load is found: each leaves a tenth of the error or less
ROUNDS = 12
# configurations of which the pose is computed at a time
POSES = 8192


@dataclass(frozen=True)
class Outcome:
    """A motion under a controller.

    Per joint (nq,): the greatest deviation `joint_error` [rad], the greatest torque of the motor `peak_torque` [N·m],
    the greatest `limit_ratio` of a torque to its limit, on the side that the limit is for, and how long the motor's
    torque was cut to it, `saturated` [s]. `tcp_error` and `end_error` [m] are the greatest deviation of the TCP and
    that at the end. `energy` is that of the motion as it went, without waiting afterwards.
    """

    joint_error: Array
    tcp_error: float
    end_error: float
    peak_torque: Array
    limit_ratio: Array
    saturated: Array
    energy: Energy
    contact: Contact | None

    @property
    def collides(self) -> bool:
        """Whether a contact is deeper than TOUCH, or than the TCP was off its motion if that is less."""
        return self.contact is not None and self.contact.depth > min(self.tcp_error, TOUCH)


def outcome(arm: Arm, motion: Reference, played: Played) -> Outcome:
    """What a motion amounts to that the simulated `arm` played."""
    tau = _without_friction(arm, played)
    plant, q, v = Plant(arm), played.q, played.v
    # the trapezoidal rule
    weights = np.full(len(q), played.step)
    weights[[0, -1]] /= 2
    off = _distances(arm, q, motion.q)
    limited = limited_torque(arm, tau, v, played.a)
    return Outcome(
        joint_error=np.abs(q - motion.q).max(axis=0),
        tcp_error=float(off.max()),
        end_error=float(off[-1]),
        peak_torque=np.abs(played.tau_motor).max(axis=0),
        limit_ratio=np.abs(limited).max(axis=0) / arm.active_limits.tau_max,
        saturated=played.saturated.sum(axis=0) * played.step,
        energy=breakdown(weights, v, played.a, tau, plant.potential(q[-1]) - plant.potential(q[0]), arm),
        contact=played.contact,
    )


def _without_friction(arm: Arm, played: Played) -> Array:
    """Torques of rigid bodies and rotors (n, nq) [N·m], to which friction adds up to that of the motors.

    Friction that grows with the load depends on these themselves; it is a small part of them.
    """
    tau = played.tau_motor
    for _ in range(1 if arm.friction_law.load is None else ROUNDS):
        tau = played.tau_motor - friction_torque(arm.friction_law, arm.drives, tau, played.v, played.a)
    return tau


def _distances(arm: Arm, q: Array, others: Array) -> Array:
    """Distances (k,) [m] between the TCP at q (k, nq) [rad] and at others (k, nq) [rad]."""
    found = np.empty(len(q))
    for low in range(0, len(q), POSES):
        block = slice(low, low + POSES)
        ours, theirs = (tcp_pose(arm, each[block])[:, :3, 3] for each in (q, others))
        found[block] = np.linalg.norm(ours - theirs, axis=1)
    return found
