"""Power on the arm's bus from its motion, and the derivatives of it by the figures.

P = max(P_net, 0) - regeneration · max(-P_net, 0),
P_net = idle + Σ_j (tau_j v_j + copper_j i_j² + inverter_linear_j |i_j|),  i = tau / torque_constant,
tau = tau_rigid + rotor_inertia a + factor · friction: the law of `optimizer.energy.losses`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """What the power follows from, (n, nq): v [rad/s], torques [N·m] without friction `link`, and of `friction`."""

    v: Array
    link: Array
    friction: Array


@dataclass(frozen=True, eq=False)
class Electrics:
    """`idle` [W], and per joint (nq,): `copper` [W/A²], `inverter` [W/A], and the `factor` on the friction."""

    idle: float
    copper: Array
    inverter: Array
    factor: Array

    def packed(self) -> Array:
        """All of them (1 + 3 nq,)."""
        return np.concatenate([[self.idle], self.copper, self.inverter, self.factor])

    @staticmethod
    def unpacked(values: Array) -> Electrics:
        """The inverse of `packed`."""
        return Electrics(float(values[0]), *np.split(values[1:], 3))


def power(electrics: Electrics, motion: Motion, constant: Array, regeneration: float) -> tuple[Array, Array]:
    """Power (n,) [W], and its derivatives (n, 1 + 3 nq) by the packed figures; `constant` (nq,) [N·m/A]."""
    tau = motion.link + electrics.factor * motion.friction
    i = tau / constant
    net = electrics.idle + (tau * motion.v + electrics.copper * i**2 + electrics.inverter * np.abs(i)).sum(axis=1)
    by_tau = motion.v + (2 * electrics.copper * i + electrics.inverter * np.sign(i)) / constant
    derivatives = np.hstack([np.ones((len(net), 1)), i**2, np.abs(i), by_tau * motion.friction])
    slope = np.where(net >= 0, 1.0, regeneration)
    return slope * net, slope[:, None] * derivatives
