"""Base parameters from the force and torque beneath the arm (Christoforou et al.): without friction, without currents.

A sensor under the base measures what all moving links exert on the ground. That wrench is linear in the same parameters
of the bodies as the torques, and friction and motors within the arm do not act on it. Rotors are neglected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.energy.link_regressor import BODY
from joulepath.optimizer.identify.arm.base_parameters import independent_columns
from joulepath.optimizer.identify.estimates.grouped import Grouped, jackknife, left_out, solve

STATES = 60


@dataclass(frozen=True, eq=False)
class WrenchFit:
    """Base parameters (b,) of the wrench, their covariance, and how they are combined from those of the bodies."""

    value: Array
    covariance: Array
    combination: Array


def base_wrench_regressor(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """The matrices (n, 6, 10 nq) whose products with the bodies' parameters are the wrench that the moving links exert
    on the base: force [N] and torque [N·m] about its origin, in its axes."""
    data = model.createData()
    found = np.empty((len(q), 6, BODY * model.nq))
    for row in range(len(q)):
        checkpoint()
        pin.rnea(model, data, q[row], v[row], a[row])
        pin.forwardKinematics(model, data, q[row])
        for joint in range(1, model.njoints):
            body = pin.jointBodyRegressor(model, data, joint)
            at = slice(BODY * (joint - 1), BODY * joint)
            # minus: what the base exerts on the links acts back on it
            found[row, :, at] = -data.oMi[joint].toDualActionMatrix() @ body
    return found


def fit_base_wrench(model: pin.Model, q: Array, v: Array, a: Array, wrench: Array, move: Array) -> WrenchFit:
    """Base parameters from wrenches (n, 6) at q, v, a (n, nq); the spread is that over the moves (n,) of the rows."""
    random = np.random.default_rng(0)
    states = (random.uniform(-reach, reach, (STATES, model.nq)) for reach in (np.pi, 2.0, 5.0))
    kept, combination = independent_columns(base_wrench_regressor(model, *states).reshape(6 * STATES, -1))
    columns = base_wrench_regressor(model, q, v, a)[:, :, list(kept)]
    numbers = np.unique(move, return_inverse=True)[1]
    # forces and torques have different units: each of the six by the size of its noise, about that of its values
    scale = np.maximum(wrench.std(axis=0), 1e-9)
    flat = (columns / scale[:, None]).reshape(-1, len(kept))
    grouped = Grouped.of(
        flat, (wrench / scale).ravel(), np.ones(len(flat)), np.repeat(numbers, 6), int(numbers.max()) + 1
    )
    value = solve(grouped.gram.sum(axis=0), grouped.moment.sum(axis=0), np.full(len(kept), -np.inf))
    spread = left_out(grouped, value, np.ones(len(kept), dtype=bool))
    return WrenchFit(value, jackknife(spread), combination)
