"""Regression columns of an arm's torques at states of a motion, with gradients.

The torques are linear in base parameters of links and rotors and in friction coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import body_parameters
from joulepath.optimizer.dynamics.torque_regressor import torque_regressor
from joulepath.optimizer.excitation.excitation_problem import Part
from joulepath.optimizer.identify.arm.base_parameters import base_parameters
from joulepath.optimizer.identify.fits.torque_fit import TORQUE_FIT
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class ColumnSettings:
    """Settings of the columns."""

    knee: float = 0.05
    """Speed over which the sign of a speed is smoothed [rad/s]; friction of slower joints carries
    little information."""
    load_corner: float = 0.01
    """Rounded corner of the absolute rigid torque over the torque limit [1]."""
    poses: int = 200
    """Number of random poses at which gravity torques are compared."""


COLUMNS = ColumnSettings()


class TorqueColumns:
    """Columns for n states of an arm: base parameters of links and rotors, then friction of each
    joint.

    Load friction depends on the arm's own rigid torque; it has a column at joints whose load varies
    enough to determine it.

    Attributes:
        names: names (p,) of the columns.
        wanted: indices of the columns of the requested parameters.
        dynamics: the arm's own values (p,) of links and rotors, and zero for friction; with them,
        the
            columns give the torques without friction.
    """

    def __init__(self, arm: Arm, parts: Sequence[Part], n: int) -> None:
        model = rigid_body_model(arm)
        base, nq = base_parameters(model), model.nq
        q, v, a = (ca.SX.sym(name, nq) for name in "qva")
        gravity = ca.SX(ca.DM(model.gravity.linear))
        links = torque_regressor(model, q, v, a, gravity)
        dynamics = ca.horzcat(links, ca.diag(a))[:, list(base.independent)]
        sign = v / ca.sqrt(v * v + COLUMNS.knee * COLUMNS.knee)
        carried = loaded_joints(arm)
        load = ca.diag(sign * _rounded_abs(ca.mtimes(links, ca.DM(body_parameters(model))), arm))[
            :, carried
        ]
        columns = ca.horzcat(dynamics, ca.diag(sign), ca.diag(v), ca.SX.eye(nq), load)
        seed = ca.SX.sym("seed", nq, columns.shape[1])
        state = ca.vertcat(q, v, a)
        self.shape = (nq, columns.shape[1])
        self._values = ca.Function("columns", [q, v, a], [ca.densify(columns)]).map(n)
        pulled = ca.gradient(ca.dot(seed, columns), state)
        self._pulled_back = ca.Function("pulled_back", [q, v, a, seed], [ca.densify(pulled)]).map(n)
        kinds = ("coulomb", "viscous", "offset")
        friction = [f"{kind}{j}" for kind in kinds for j in range(1, nq + 1)] + [
            f"load{j + 1}" for j in carried
        ]
        self.names = (*base.expressions, *friction)
        self.dynamics = np.append(base.combination @ _own_values(model), np.zeros(len(friction)))
        self.wanted = _wanted(base.independent, nq, parts, len(friction))

    def values(self, q: Array, v: Array, a: Array) -> Array:
        """Columns (n, nq, p) at states q, v, a (n, nq)."""
        found = np.array(self._values(q.T, v.T, a.T)).reshape(self.shape[0], len(q), self.shape[1])
        return np.ascontiguousarray(found.transpose(1, 0, 2))

    def pulled_back(self, q: Array, v: Array, a: Array, seed: Array) -> tuple[Array, Array, Array]:
        """Gradients (n, nq) by q, v and a of Σ seed · columns, for seeds (n, nq, p)."""
        flat = seed.transpose(1, 0, 2).reshape(self.shape[0], -1)
        found = np.array(self._pulled_back(q.T, v.T, a.T, flat)).T
        by_q, by_v, by_a = np.split(found, 3, axis=1)
        return by_q, by_v, by_a


def loaded_joints(arm: Arm) -> list[int]:
    """Joints whose gravity torque varies enough for an identification of load friction."""
    model, limits = rigid_body_model(arm), arm.active_limits
    data = model.createData()
    low, high = np.maximum(limits.q_min, -np.pi), np.minimum(limits.q_max, np.pi)
    poses = np.random.default_rng(0).uniform(low, high, (COLUMNS.poses, model.nq))
    gravity = np.array([pin.computeGeneralizedGravity(model, data, q) for q in poses])
    least = TORQUE_FIT.min_load_spread * arm.robot.limits.tau_max
    return np.flatnonzero(gravity.std(axis=0) >= least).tolist()


def _rounded_abs(tau: ca.SX, arm: Arm) -> ca.SX:
    """Absolute rigid torques (nq,) with a rounded corner."""
    corner = ca.DM(COLUMNS.load_corner * arm.robot.limits.tau_max)
    return ca.sqrt(tau * tau + corner * corner)


def _own_values(model: pin.Model) -> Array:
    """Parameters of bodies, then rotor inertias."""
    return np.append(body_parameters(model), model.armature)


def _wanted(independent: Sequence[int], nq: int, parts: Sequence[Part], friction: int) -> list[int]:
    """Indices of the columns of the requested parameters.

    Args:
        independent: numbers of the independent standard parameters.
        nq: number of joints.
        parts: requested parameters.
        friction: number of columns of friction.
    """
    rotors = 10 * nq
    chosen = [
        k
        for k, number in enumerate(independent)
        if ("inertials" if number < rotors else "rotor") in parts
    ]
    if "friction" in parts:
        chosen += range(len(independent), len(independent) + friction)
    return chosen
