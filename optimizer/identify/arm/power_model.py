"""Power on the arm's bus from its motion, with the derivatives by the figures.

P = max(P_net, 0) - regeneration · max(-P_net, 0),
P_net = idle + Σ_j (tau_j v_j + copper_j i_j² + inverter_linear_j |i_j|),
i = tau / torque_constant,
tau = tau_rigid + rotor_inertia a + friction, the law of `joulepath.optimizer.dynamics.losses`.

The torque parts of a motion are computed once. The figures then act on them: one factor on the
masses of all links, factors on rotors, dry and viscous friction, an increment of load friction and
an increment of the offset.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array


@dataclass(frozen=True, eq=False)
class TorqueParts:
    """Speeds and torque parts [N·m] of a motion, shape (n, nq) unless stated otherwise."""

    v: Array
    """Velocities [rad/s]."""
    smooth_sign: Array
    """v / sqrt(v² + knee²) [1]."""
    rigid: Array
    """Rigid-body torques of links and load."""
    links: Array
    """Part of the arm's own links in `rigid`."""
    dry: Array
    """Coulomb and curved friction."""
    viscous: Array
    """Viscous friction."""
    rotor: Array
    """Inertia of the rotors."""
    other: Array
    """Offsets and couplings."""
    load: Array
    """Load friction (nq,) over the rigid torque [1]."""


@dataclass(frozen=True, eq=False)
class PowerParameters:
    """Figures of the power model, per joint (nq,) unless stated otherwise.

    Packed into one array (2 + 7 nq,), they stand in the order of the fields.
    """

    idle: float
    """Idle power [W]."""
    copper: Array
    """Copper loss over the squared current [W/A²]."""
    inverter: Array
    """Inverter loss over the current [W/A]."""
    dry_factor: Array
    """Factor on dry friction [1]."""
    viscous_factor: Array
    """Factor on viscous friction [1]."""
    rotor_factor: Array
    """Factor on the rotor inertia [1]."""
    load_increment: Array
    """Increment of load friction [1]."""
    offset_increment: Array
    """Increment of the torque offset [N·m]."""
    link_scale: float
    """Factor on the masses of all links [1]."""

    @staticmethod
    def unpacked(values: Array) -> PowerParameters:
        """Figures from their packed form (2 + 7 nq,)."""
        copper, inverter, dry, viscous, rotor, load, offset = np.split(values[1:-1], 7)
        return PowerParameters(
            float(values[0]), copper, inverter, dry, viscous, rotor, load, offset, float(values[-1])
        )

    @staticmethod
    def nominal(idle: float, copper: Array, inverter: Array) -> PowerParameters:
        """Figures that leave the torque parts of the motion unchanged."""
        one, zero = np.ones_like(copper), np.zeros_like(copper)
        return PowerParameters(idle, copper, inverter, one, one, one, zero, zero, 1.0)


def packed_size(nq: int) -> int:
    """Number of packed figures."""
    return 2 + 7 * nq


def friction_torque(parts: TorqueParts) -> Array:
    """Friction torque (n, nq) [N·m], without offsets and couplings."""
    return parts.dry + parts.viscous + parts.load * np.abs(parts.rigid) * parts.smooth_sign


def power_of_torque(
    figures: PowerParameters, v: Array, torque: Array, torque_constant: Array, regeneration: float
) -> Array:
    """Power (n,) [W] on the bus for motor torques (n, nq) [N·m] at speeds v (n, nq) [rad/s]."""
    i = torque / torque_constant
    joints = torque * v + figures.copper * i**2 + figures.inverter * np.abs(i)
    net = figures.idle + joints.sum(axis=1)
    return np.asarray(np.where(net >= 0, 1.0, regeneration) * net)


def bus_power(
    figures: PowerParameters, parts: TorqueParts, torque_constant: Array, regeneration: float
) -> tuple[Array, Array]:
    """Power on the bus, with its derivatives.

    Args:
        figures: figures of the power model.
        parts: torque parts of the motion.
        torque_constant: torque constants (nq,) [N·m/A].
        regeneration: regained share of negative power [1].

    Returns:
        Power (n,) [W], and its derivatives (n, 2 + 7 nq) by the packed figures.
    """
    rigid = parts.rigid + (figures.link_scale - 1) * parts.links
    load = parts.load + figures.load_increment
    loaded = np.abs(rigid) * parts.smooth_sign
    tau = (
        parts.other
        + figures.offset_increment
        + rigid
        + figures.rotor_factor * parts.rotor
        + figures.dry_factor * parts.dry
        + figures.viscous_factor * parts.viscous
        + load * loaded
    )
    i = tau / torque_constant
    net = figures.idle + (tau * parts.v + figures.copper * i**2 + figures.inverter * np.abs(i)).sum(
        axis=1
    )
    by_tau = parts.v + (2 * figures.copper * i + figures.inverter * np.sign(i)) / torque_constant
    by_links = by_tau * parts.links * (1 + load * np.sign(rigid) * parts.smooth_sign)
    by_factors = [by_tau * part for part in (parts.dry, parts.viscous, parts.rotor, loaded)]
    ones = np.ones((len(net), 1))
    derivatives = np.hstack(
        [ones, i**2, np.abs(i), *by_factors, by_tau, by_links.sum(axis=1, keepdims=True)]
    )
    slope = np.where(net >= 0, 1.0, regeneration)
    return slope * net, slope[:, None] * derivatives
