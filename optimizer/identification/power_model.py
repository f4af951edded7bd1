"""Power on the arm's bus from its motion, and the derivatives of it by the figures.

P = max(P_net, 0) - regeneration · max(-P_net, 0),
P_net = idle + Σ_j (tau_j v_j + copper_j i_j² + inverter_linear_j |i_j|),  i = tau / torque_constant,
tau = tau_rigid + rotor_inertia a + factor · friction: the law of `optimizer.energy.losses`. In tau_rigid, the torques
of the arm's own bodies have the factor `links`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """What the power follows from, (n, nq): v [rad/s], torques [N·m] without friction `link`, the part of these that is
    of the arm's own `bodies`, and those of `friction`."""

    v: Array
    link: Array
    bodies: Array
    friction: Array


@dataclass(frozen=True, eq=False)
class Electrics:
    """`idle` [W], and per joint (nq,): `copper` [W/A²], `inverter` [W/A], and the `factor` on the friction. `links` is
    the factor on the masses of all links. Packed (2 + 3 nq,), they stand in this order."""

    idle: float
    copper: Array
    inverter: Array
    factor: Array
    links: float = 1.0

    @staticmethod
    def unpacked(values: Array) -> Electrics:
        """From packed figures (2 + 3 nq,)."""
        copper, inverter, factor = np.split(values[1:-1], 3)
        return Electrics(float(values[0]), copper, inverter, factor, float(values[-1]))


def packed_size(nq: int) -> int:
    """Number of packed figures."""
    return 2 + 3 * nq


def power(electrics: Electrics, motion: Motion, constant: Array, regeneration: float) -> tuple[Array, Array]:
    """Power (n,) [W], and its derivatives (n, 2 + 3 nq) by the packed figures; `constant` (nq,) [N·m/A]."""
    tau = motion.link + (electrics.links - 1) * motion.bodies + electrics.factor * motion.friction
    i = tau / constant
    net = electrics.idle + (tau * motion.v + electrics.copper * i**2 + electrics.inverter * np.abs(i)).sum(axis=1)
    by_tau = motion.v + (2 * electrics.copper * i + electrics.inverter * np.sign(i)) / constant
    by_links = (by_tau * motion.bodies).sum(axis=1, keepdims=True)
    derivatives = np.hstack([np.ones((len(net), 1)), i**2, np.abs(i), by_tau * motion.friction, by_links])
    slope = np.where(net >= 0, 1.0, regeneration)
    return slope * net, slope[:, None] * derivatives
