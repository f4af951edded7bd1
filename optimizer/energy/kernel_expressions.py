"""The per-node functions of the NLP as CasADi expressions, and their parameters."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.robot import Array, Drives, FrictionLaw, Robot
from optimizer.energy.inverse_dynamics import SymbolicPayload, inverse_dynamics
from optimizer.energy.losses import drawn_power, power_flow, smooth_abs


@dataclass(frozen=True)
class Parameters:
    """What a request may change, in the order in which the compiled functions take it.

    Shapes: com (3,), inertia (6,) ixx ixy ixz iyy iyz izz, gravity (3,), per joint (nq,). `knee` [rad/s] and `width`
    [W] smooth friction's reversal and the cost's corners; `isolated` is 1 where every joint burns its own surplus, else
    0; `electrical`, `mechanical` [1] and `time` [W] weigh the cost.
    """

    mass: Any
    com: Any
    inertia: Any
    gravity: Any
    rotor_inertia: Any
    coulomb: Any
    curved: Any
    speed: Any
    viscous: Any
    torque_constant: Any
    copper: Any
    inverter_constant: Any
    inverter_linear: Any
    inverter_quadratic: Any
    base_power: Any
    regeneration: Any
    isolated: Any
    link_mass_scale: Any
    electrical: Any
    mechanical: Any
    time: Any
    knee: Any
    width: Any

    def pack(self) -> Array:
        """One vector."""
        return np.concatenate([np.atleast_1d(np.asarray(value, dtype=float)) for value in astuple(self)])

    @staticmethod
    def symbols(nq: int) -> tuple[Parameters, ca.SX]:
        """Symbols of the same layout, and their vector."""
        sizes = {"com": 3, "inertia": 6, "gravity": 3}
        scalars = {"mass", "base_power", "regeneration", "isolated"}
        scalars |= {"electrical", "mechanical", "time", "knee", "width"}
        scalars |= {"electrical", "mechanical", "time", "knee", "width"}
        names = Parameters.__dataclass_fields__
        values = {n: ca.SX.sym(n, sizes.get(n, 1 if n in scalars else nq)) for n in names}
        return Parameters(**values), ca.vertcat(*values.values())


def build(robot: Robot) -> list[ca.Function]:
    """The functions of a robot as CasADi expressions.

    `torque`(y, p) → tau: rigid body and rotor torque.
    `value`(y, p) → cost, tau_motor.
    `node`(y, multiplier, weight, p) → cost, tau_motor, gradient of the cost, Jacobian of tau_motor (nq, 3 nq), and the
    Hessian (3 nq, 3 nq) of weight · cost + multiplier · tau_motor. y = (q, v, a) stacked.
    """
    nq = robot.nq
    y = ca.SX.sym("y", 3 * nq)
    q, v, a = y[:nq], y[nq : 2 * nq], y[2 * nq :]
    par, p = Parameters.symbols(nq)
    payload = SymbolicPayload(par.mass, par.com, par.inertia)
    tau = inverse_dynamics(robot.model, q, v, a, payload, par.gravity, par.rotor_inertia, par.link_mass_scale)
    friction = FrictionLaw("symbolic", par.coulomb, par.curved, par.speed, par.viscous, par.knee)
    drives = Drives(
        gear_ratio=None,  # type: ignore[arg-type]
        torque_constant=par.torque_constant,
        rotor_inertia=par.rotor_inertia,
        copper=par.copper,
        inverter_constant=par.inverter_constant,
        inverter_linear=par.inverter_linear,
        inverter_quadratic=par.inverter_quadratic,
    )
    # cost and friction of torque t and speed w, apart from the dynamics that t comes from
    t, w = ca.SX.sym("t", nq), ca.SX.sym("w", nq)
    # the inverter's |i| is rounded off over a tenth of an ampere per watt of width
    flow = power_flow(t, w, drives, friction, 0.1 * par.width, ca)
    shared = drawn_power(par.base_power + ca.sum1(flow.joints), par.regeneration, par.width, ca)
    # six corners in place of one, each rounded off by a sixth
    isolated = par.base_power + ca.sum1(drawn_power(flow.joints, 0, par.width / nq, ca))
    drawn = (1 - par.isolated) * shared + par.isolated * isolated
    mechanical = ca.sum1(smooth_abs(t * w, par.width, ca))
    cost = par.electrical * drawn + par.mechanical * mechanical + par.time
    multiplier, weight = ca.SX.sym("multiplier", nq), ca.SX.sym("weight")
    inner = ca.vertcat(t, w)
    bent, sloped = ca.hessian(cost, inner)
    friction_bent, _ = ca.hessian(ca.dot(multiplier, friction.torque(w, ca)), w)
    local = [cost, flow.tau_motor, sloped, bent, ca.jacobian(friction.torque(w, ca), w), friction_bent]
    cost, tau_motor, sloped, bent, friction_slope, friction_bent = ca.substitute(local, [t, w], [tau, v])

    # the chain rule by hand: a third of the operations that differentiating the composed cost twice would take
    J_tau = ca.jacobian(tau, y)
    J_inner = ca.vertcat(J_tau, ca.horzcat(ca.SX(nq, nq), ca.SX.eye(nq), ca.SX(nq, nq)))
    pull = ca.SX.sym("pull", nq)
    dynamics_bent = ca.substitute(ca.hessian(ca.dot(pull, tau), y)[0], pull, weight * sloped[:nq] + multiplier)
    # half of a symmetric product, mirrored
    hessian = dynamics_bent + ca.tril2symm(ca.tril(J_inner.T @ (weight * bent @ J_inner)))
    hessian[nq : 2 * nq, nq : 2 * nq] += friction_bent
    J_motor = J_tau + 0
    J_motor[:, nq : 2 * nq] += friction_slope
    dense = ca.densify
    return [
        ca.Function("torque", [y, p], [dense(tau)], {"cse": True}),
        ca.Function("value", [y, p], [cost, dense(tau_motor)], {"cse": True}),
        ca.Function(
            "node",
            [y, multiplier, weight, p],
            [cost, dense(tau_motor), dense(J_inner.T @ sloped), dense(J_motor), dense(hessian)],
            {"cse": True},
        ),
    ]


FUNCTION_NAMES = ("torque", "value", "node")
