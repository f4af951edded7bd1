"""Motions within joint limits, searched for the largest torques relative to the torque limits."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.joint_limits.torque_load import Rates
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.problem.arm import Arm, Payload

STARTS = 100
"""Random postures of an attack."""
STEPS = 40
"""Random steps from the worst posture of each joint, ever smaller, uphill only."""


def worst_ratio(arm: Arm, rates: Rates, lower: Array, upper: Array) -> float:
    """Largest torque / limit that was found by Pinocchio's inverse dynamics.

    Args:
        arm: the arm with its payload; lighter ones are tried, too.
        rates: limits on speeds and accelerations.
        lower: least joint positions, shape (nq,) [rad].
        upper: largest joint positions, shape (nq,) [rad].
    """
    random = np.random.default_rng(1)
    postures = random.uniform(lower, upper, (STARTS, arm.robot.nq))
    ratios = np.array([torque_ratios(arm, q, rates) for q in postures])
    best = 0.0
    for joint in range(arm.robot.nq):
        q, most = postures[ratios[:, joint].argmax()], float(ratios[:, joint].max())
        for step in np.geomspace(1.0, 0.003, STEPS):
            tried = np.clip(q + step * random.normal(size=len(q)), lower, upper)
            ratio = float(torque_ratios(arm, tried, rates)[joint])
            if ratio > most:
                q, most = tried, ratio
        best = max(best, most)
    return best


def torque_ratios(arm: Arm, q: Array, rates: Rates) -> Array:
    """Largest torque / limit per joint at a posture q (nq,) [rad], shape (nq,)."""
    payload = arm.payload
    half = Payload(payload.mass / 2, payload.com, payload.inertia / 2)
    arms = [arm, replace(arm, payload=half), replace(arm, payload=Payload())]
    signs = np.array(list(product((1.0, -1.0), repeat=len(q))))
    found = []
    for arm in arms:
        model = rigid_body_model(arm)
        data = model.createData()
        rest = np.zeros_like(q)
        drift = np.array([pin.rnea(model, data, q, s * rates.v, rest) for s in signs])
        gravity = pin.rnea(model, data, q, rest, rest)
        M = np.array([pin.rnea(model, data, q, rest, e) - gravity for e in np.eye(len(q))]).T
        for joint in range(len(q)):
            for side in (1.0, -1.0):
                worst = (side * drift[:, joint]).argmax()
                a = side * np.sign(M[joint]) * rates.a
                tau = drift[worst] + M @ a
                # the same torque with all speeds reversed, but for friction
                for v in (signs[worst] * rates.v, -signs[worst] * rates.v):
                    torque = limited_torque(arm, tau[None], v[None], a[None])[0]
                    found.append(np.abs(torque) / arm.active_limits.tau_max)
    return np.max(found, axis=0)
