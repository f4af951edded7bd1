"""The greatest torques of an arm over all speeds, accelerations and payloads within limits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.joint_limits.posture_terms import PostureTerms
from joulepath.optimizer.problem.arm import Arm, Payload


@dataclass(frozen=True)
class Rates:
    """Limits on speeds `v` [rad/s] and accelerations `a` [rad/s²], shape (nq,) each."""

    v: Array
    a: Array


class TorqueLoad:
    """An arm's torque limits, as limits on the torques τ of its bodies.

    The torque of a motor is τ + rotor · a + friction, and friction is at most f(v) + load · (|τ| +
    bend) with the friction f of the unloaded joint. The limit therefore holds if

        |τ| ≤ (τ_max - rotor · a - f(v) - load · bend) / (1 + load).

    A limit on the torque of the link is one on τ itself.
    """

    def __init__(self, arm: Arm) -> None:
        """The torques of an arm that carries its payload, or a lighter one."""
        self._tau_max = arm.active_limits.tau_max
        law, zero = arm.friction_law, np.zeros(arm.robot.nq)
        at_motor = arm.robot.torque_side == "motor"
        self._friction = law.unloaded if at_motor else None
        self._rotor = arm.drives.rotor_inertia if at_motor else zero
        self._load = zero if law.load is None or not at_motor else law.load
        self._bend = law.bend
        self.chains = [ChainDerivatives.of(each) for each in (arm, replace(arm, payload=Payload()))]
        """The arm with and without its payload. τ is linear in the mass of a payload with the same
        centre of mass and radii of gyration: |τ| of a lighter one exceeds neither.
        """

    def allowed(self, rates: Rates) -> Array:
        """Largest |τ| that the torque limits allow within given limits, shape (nq,) [N·m]."""
        friction = 0.0 if self._friction is None else self._friction.torque(rates.v)
        left = self._tau_max - self._rotor * rates.a - friction - self._load * self._bend
        return np.asarray(left / (1 + self._load))


def greatest_torques(terms: PostureTerms, rates: Rates) -> Array:
    """Greatest |τ| at n postures within given limits, shape (n, nq) [N·m].

    It is convex in the terms. The products v_j v_k of two joints are linear in each speed, and thus
    greatest at its limits; a square v_j² is anything between 0 and its greatest value.
    """
    nq = len(rates.v)
    first, second = np.triu_indices(nq, 1)
    # the signs of all speeds may change together
    signs = np.array([(1.0, *others) for others in product((1.0, -1.0), repeat=nq - 1)])
    at_limits = terms.velocity * rates.v[:, None] * rates.v
    products = 2 * at_limits[..., first, second] @ (signs[:, first] * signs[:, second]).T
    squares = at_limits.diagonal(axis1=2, axis2=3)
    up = products.max(axis=-1) + np.maximum(squares, 0).sum(axis=-1) + terms.gravity
    down = -products.min(axis=-1) - np.minimum(squares, 0).sum(axis=-1) - terms.gravity
    return np.asarray(np.abs(terms.inertia) @ rates.a + np.maximum(up, down))
