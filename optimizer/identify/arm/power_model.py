"""Power on the arm's bus from its motion, and the derivatives of it by the figures.

P = max(P_net, 0) - regeneration · max(-P_net, 0),
P_net = idle + Σ_j (tau_j v_j + copper_j i_j² + inverter_linear_j |i_j|),  i = tau /
torque_constant,
tau = tau_rigid + rotor_inertia a + friction: the law of `joulepath.optimizer.dynamics.losses`.

What may differ from the figures that the motion was computed with: the masses of the arm's links,
all by the factor `links`; rotors, dry and viscous friction by factors; friction by `load` more of
the rigid torque, and by an `offset`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """What the power follows from, (n, nq): v [rad/s], `step` v / sqrt(v² + knee²), and torques
    [N·m].

    `rigid` is that of links and payload, `bodies` the part of the arm's own links in it; `dry` that
    of Coulomb and curved friction, `viscous`, `rotor`; `other` of offsets and couplings. `load`
    (nq,) [1] is the friction that grows with the rigid torque.
    """

    v: Array
    step: Array
    rigid: Array
    bodies: Array
    dry: Array
    viscous: Array
    rotor: Array
    other: Array
    load: Array


@dataclass(frozen=True, eq=False)
class Electrics:
    """`idle` [W], and per joint (nq,): `copper` [W/A²], `inverter` [W/A], factors on `dry` and
    `viscous` friction and on the `rotor`, and `load` and `offset` [N·m], which are added to those
    of the motion. `links` is the factor on the masses of all links.

    Packed (2 + 7 nq,), they stand in this order."""

    idle: float
    copper: Array
    inverter: Array
    dry: Array
    viscous: Array
    rotor: Array
    load: Array
    offset: Array
    links: float

    @staticmethod
    def unpacked(values: Array) -> Electrics:
        """From packed figures (2 + 7 nq,)."""
        copper, inverter, dry, viscous, rotor, load, offset = np.split(values[1:-1], 7)
        return Electrics(
            float(values[0]), copper, inverter, dry, viscous, rotor, load, offset, float(values[-1])
        )

    @staticmethod
    def plain(idle: float, copper: Array, inverter: Array) -> Electrics:
        """With friction, rotors and links as the motion has them."""
        one, none = np.ones_like(copper), np.zeros_like(copper)
        return Electrics(idle, copper, inverter, one, one, one, none, none, 1.0)


def packed_size(nq: int) -> int:
    """Number of packed figures."""
    return 2 + 7 * nq


def friction(motion: Motion) -> Array:
    """Friction torque (n, nq) [N·m], without offsets and couplings."""
    return motion.dry + motion.viscous + motion.load * np.abs(motion.rigid) * motion.step


def power(
    electrics: Electrics, motion: Motion, constant: Array, regeneration: float
) -> tuple[Array, Array]:
    """Power (n,) [W], and its derivatives (n, 2 + 7 nq) by the packed figures; `constant` (nq,)
    [N·m/A].
    """
    rigid, load = motion.rigid + (electrics.links - 1) * motion.bodies, motion.load + electrics.load
    loaded = np.abs(rigid) * motion.step
    dry, viscous = electrics.dry * motion.dry, electrics.viscous * motion.viscous
    tau = (
        motion.other
        + electrics.offset
        + rigid
        + electrics.rotor * motion.rotor
        + dry
        + viscous
        + load * loaded
    )
    i = tau / constant
    net = electrics.idle + (
        tau * motion.v + electrics.copper * i**2 + electrics.inverter * np.abs(i)
    ).sum(axis=1)
    by_tau = motion.v + (2 * electrics.copper * i + electrics.inverter * np.sign(i)) / constant
    by_links = by_tau * motion.bodies * (1 + load * np.sign(rigid) * motion.step)
    torques = [by_tau * part for part in (motion.dry, motion.viscous, motion.rotor, loaded)]
    ones = np.ones((len(net), 1))
    derivatives = np.hstack(
        [ones, i**2, np.abs(i), *torques, by_tau, by_links.sum(axis=1, keepdims=True)]
    )
    slope = np.where(net >= 0, 1.0, regeneration)
    return slope * net, slope[:, None] * derivatives
