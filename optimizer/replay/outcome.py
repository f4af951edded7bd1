"""Outcome of a simulated motion: deviations, torques, energy and contacts."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Self

import numpy as np

from joulepath.models.immutable import ReadOnlyArrays
from joulepath.models.robot import Array
from joulepath.optimizer.declared import Internal, Joules, Metres, PerJoint, Ratio, Unit
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.dynamics.losses import breakdown, friction_torque
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.replay.planned import PlannedMotion
from joulepath.optimizer.replay.play import Contact, Played
from joulepath.optimizer.replay.reference import Reference
from joulepath.optimizer.result.energy import Energy


@dataclass(frozen=True)
class OutcomeSettings:
    """Settings of the evaluation of a simulated motion."""

    max_touch: float = 2.5e-4
    """Depth of a contact that tracking errors explain [m]; motions may be planned closer to
    obstacles than any controller follows them."""
    friction_iterations: int = 12
    """Fixed-point iterations for friction that grows with the load; each leaves at most a tenth of
    the error."""
    poses_at_once: int = 8192
    """Configurations whose poses are computed at once."""


OUTCOME = OutcomeSettings()


@dataclass(frozen=True, kw_only=True)
class Outcome(ReadOnlyArrays):
    """The motion of the simulated arm. Lists have one number per joint, from base to flange."""

    electrical: Joules = field(init=False)
    """Energy drawn from the supply, without waiting at the goal."""
    mechanical: Joules = field(init=False)
    """Mechanical work."""
    electrical_error: Ratio
    """`electrical` / that of the answer - 1."""
    mechanical_error: Ratio
    """`mechanical` / that of the answer - 1."""
    contact: Contact | None
    """The deepest contact; null if there was none."""
    joint_error: Annotated[PerJoint, Unit("rad")]
    """Largest deviation from the motion, per joint."""
    tcp_error: Metres
    """Largest distance of the TCP from the motion."""
    end_error: Metres
    """Distance of the TCP from its goal when the motion ends."""
    peak_torque: Annotated[PerJoint, Unit("N·m")]
    """Largest torque of the motor at the joint, friction included, per joint."""
    limit_ratio: Annotated[PerJoint, Unit("1")]
    """Largest torque / limit, on the side of the robot's `limits.torque_side`, per joint."""
    saturated: Annotated[PerJoint, Unit("s")]
    """Time during which the motor gave its largest torque and the controller commanded more, per
    joint."""
    collides: bool = field(init=False)
    """Whether a contact is deeper than 0.25 mm, or than `tcp_error` if that is less: a planned
    distance may be smaller than any controller's error."""
    energy: Annotated[Energy, Internal]
    """Energy of the motion as it went, without waiting afterwards."""

    def __post_init__(self) -> None:
        super().__post_init__()
        contact, energy = self.contact, self.energy
        collides = contact is not None and contact.depth > min(self.tcp_error, OUTCOME.max_touch)
        object.__setattr__(self, "electrical", energy.electrical.total)
        object.__setattr__(self, "mechanical", energy.mechanical.total)
        object.__setattr__(self, "collides", collides)

    @classmethod
    def extended(cls, outcome: Outcome, **own: Any) -> Self:
        """An outcome with the fields of a subclass."""
        known = {each.name: getattr(outcome, each.name) for each in fields(Outcome) if each.init}
        return cls(**known, **own)


def outcome(arm: Arm, motion: Reference, played: Played, planned: PlannedMotion) -> Outcome:
    """Outcome of a planned motion.

    Args:
        arm: the simulated arm.
        motion: the planned motion on the grid of the simulation.
        played: the simulated motion.
        planned: the planned motion with its energies.
    """
    deviation = _distances(arm, played.q, motion.q)
    limited = limited_torque(arm, _without_friction(arm, played), played.v, played.a)
    energy = played_energy(arm, played)
    return Outcome(
        electrical_error=_relative(energy.electrical.total, planned.electrical),
        mechanical_error=_relative(energy.mechanical.total, planned.mechanical),
        contact=played.contact,
        joint_error=np.abs(played.q - motion.q).max(axis=0),
        tcp_error=float(deviation.max()),
        end_error=float(deviation[-1]),
        peak_torque=np.abs(played.tau_motor).max(axis=0),
        limit_ratio=np.abs(limited).max(axis=0) / arm.active_limits.tau_max,
        saturated=played.step * played.saturated.sum(axis=0, dtype=float),
        energy=energy,
    )


def played_energy(arm: Arm, played: Played) -> Energy:
    """Energy of a motion of the simulated arm, by the trapezoidal rule."""
    plant, q = Plant(arm), played.q
    weights = np.full(len(q), played.step)
    weights[[0, -1]] /= 2
    gain = plant.potential(q[-1]) - plant.potential(q[0])
    tau = _without_friction(arm, played)
    return breakdown(weights, played.v, played.a, tau, gain, arm)


def _relative(value: float, reference: float) -> float:
    return (value - reference) / abs(reference) if reference else 0.0


def _without_friction(arm: Arm, played: Played) -> Array:
    """Torques of rigid bodies and rotors (n, nq) [N·m]: motor torques without friction.

    Friction that grows with the load depends on these torques and is a small part of them, so they
    are found by fixed-point iteration.
    """
    tau = played.tau_motor
    for _ in range(1 if arm.friction_law.load is None else OUTCOME.friction_iterations):
        tau = played.tau_motor - friction_torque(
            arm.friction_law, arm.drives, tau, played.v, played.a
        )
    return tau


def _distances(arm: Arm, q: Array, others: Array) -> Array:
    """Distances (k,) [m] between the TCP at two lists of configurations (k, nq) [rad]."""
    found = np.empty(len(q))
    for low in range(0, len(q), OUTCOME.poses_at_once):
        block = slice(low, low + OUTCOME.poses_at_once)
        ours, theirs = (tcp_pose(arm, each[block])[:, :3, 3] for each in (q, others))
        found[block] = np.linalg.norm(ours - theirs, axis=1)
    return found
