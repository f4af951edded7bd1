"""CasADi expressions of the per-node functions of the NLP, and their parameters."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from joulepath.models.robot import Array, Drives, FrictionLaw, Robot
from joulepath.optimizer.dynamics.inverse_dynamics import SymbolicPayload, inverse_dynamics
from joulepath.optimizer.dynamics.losses import drawn_power, flow_with, friction_torque, smooth_abs

SYMBOLICS = threading.RLock()
"""Lock to hold while expressions are built, turned into functions, mapped or freed.

CasADi works on expressions without Python's global lock. All expressions share constants and
caches, and only some builds of CasADi guard these against other threads. Evaluating a function
needs no lock, as long as every thread has its own buffer.
"""

# Scalar fields of `Parameters`, and sizes of all fields without one number per joint.
_SCALARS = frozenset(
    (
        "mass",
        "link_side",
        "base_power",
        "regeneration",
        "isolated",
        "electrical",
        "mechanical",
        "time",
        "knee",
        "width",
    )
)
_SIZES = {"com": 3, "inertia": 6, "gravity": 3} | dict.fromkeys(_SCALARS, 1)


@dataclass(frozen=True)
class Parameters:
    """All parameters that a request may change, in the order of the compiled functions' parameter
    vector.

    The payload: `mass` [kg], `com` (3,) [m] in the flange frame, `inertia` (6,) ixx ixy ixz iyy iyz
    izz about the center of mass [kg·m²]. `gravity` (3,) [m/s²] in the base frame. Per joint (nq,):
    `rotor_inertia` [kg·m²]; friction `coulomb`, `curved` [N·m], `speed` [rad/s], `viscous`
    [N·m·s/rad], `load` [1]; drives `torque_constant` [N·m/A], `copper` [W/A²], `inverter_constant`
    [W], `inverter_linear` [W/A], `inverter_quadratic` [W/A²]; `link_mass_scale` [1].

    `link_side` is 1 if the torque limit applies at the link, 0 if it applies at the motor.
    `base_power` [W] is the power of the electronics; `regeneration` [1] the fraction of net surplus
    that the supply takes back; `isolated` is 1 if every joint dissipates its own surplus, else 0.
    `electrical`, `mechanical` [1] and `time` [W] weight the parts of the cost. `knee` [rad/s]
    smooths the reversal of friction, `bend` (nq,) [N·m] the corner of load-dependent friction, and
    `width` [W] the corners of the cost. `load` is None in a kernel without load-dependent friction.
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
    load: Any
    bend: Any
    torque_constant: Any
    copper: Any
    inverter_constant: Any
    inverter_linear: Any
    inverter_quadratic: Any
    link_side: Any
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
        """All parameters as one vector."""
        return np.concatenate(
            [np.atleast_1d(np.asarray(value, dtype=float)) for value in vars(self).values()]
        )

    @staticmethod
    def symbols(nq: int) -> tuple[Parameters, ca.SX]:
        """Symbols for an arm of nq joints, and the vector of them in the order of `pack`."""
        values = {n: ca.SX.sym(n, _SIZES.get(n, nq)) for n in Parameters.__dataclass_fields__}
        return Parameters(**values), ca.vertcat(*values.values())

    @property
    def payload(self) -> SymbolicPayload:
        """The payload's symbols."""
        return SymbolicPayload(self.mass, self.com, self.inertia)

    @property
    def friction(self) -> FrictionLaw:
        """Friction law with these coefficients."""
        law = FrictionLaw(
            "symbolic", self.coulomb, self.curved, self.speed, self.viscous, self.knee
        )
        return law if self.load is None else replace(law, load=self.load, bend=self.bend)

    @property
    def drives(self) -> Drives:
        """Drives with these coefficients; the gear ratio is not used."""
        return Drives(
            gear_ratio=None,  # type: ignore[arg-type]
            torque_constant=self.torque_constant,
            rotor_inertia=self.rotor_inertia,
            copper=self.copper,
            inverter_constant=self.inverter_constant,
            inverter_linear=self.inverter_linear,
            inverter_quadratic=self.inverter_quadratic,
        )


@dataclass(frozen=True)
class _Power:
    """Cost, and friction in the limited torque, as functions of the inner variables (tau, v, a).

    The inner variables are the torque tau (nq,) [N·m], the speed v (nq,) [rad/s] and the
    acceleration a (nq,) [rad/s²]. `gradient` (3 nq,) and `hessian` (3 nq, 3 nq) are derivatives of
    the cost by them, `friction_jacobian` (nq, 3 nq) is the derivative of the friction, and
    `friction_hessian` (3 nq, 3 nq) the second derivative of multiplier · friction.
    """

    cost: ca.SX
    friction: ca.SX
    gradient: ca.SX
    hessian: ca.SX
    friction_jacobian: ca.SX
    friction_hessian: ca.SX


def sizes(nq: int) -> dict[str, tuple[tuple[int, ...], tuple[int, ...]]]:
    """Numbers of entries of all arguments and of all results of the functions of an arm of nq
    joints, by function.
    """
    state, parameters = (
        3 * nq,
        sum(_SIZES.get(name, nq) for name in Parameters.__dataclass_fields__),
    )
    return {
        "torque": ((state, parameters), (nq,)),
        "value": ((state, parameters), (1, nq)),
        "node": ((state, nq, 1, parameters), (1, nq, state, nq * state, state * state)),
    }


def build(robot: Robot) -> list[ca.Function]:
    """Per-node functions of a robot as CasADi expressions of the stacked state y = (q, v, a).

    - `torque`(y, p) → tau: rigid-body and rotor torque [N·m].
    - `value`(y, p) → cost [W], and tau_limited [N·m], see `limited_torque`.
    - `node`(y, multiplier, weight, p) → cost, tau_limited, gradient of the cost, Jacobian (nq, 3
      nq) of tau_limited, and Hessian (3 nq, 3 nq) of weight · cost + multiplier · tau_limited
      without the negative curvature of the smoothed reversal of friction.
    """
    with SYMBOLICS:
        return _functions(robot)


def _functions(robot: Robot) -> list[ca.Function]:
    nq = robot.nq
    y = ca.SX.sym("y", 3 * nq)
    q, v, a = y[:nq], y[nq : 2 * nq], y[2 * nq :]
    par, p = Parameters.symbols(nq)
    if not robot.has_load_friction:
        par = replace(par, load=None)
    tau = inverse_dynamics(
        robot.model,
        q,
        v,
        a,
        par.payload,
        par.gravity,
        par.rotor_inertia,
        par.link_mass_scale,
        robot.coupling,
    )
    multiplier, weight = ca.SX.sym("multiplier", nq), ca.SX.sym("weight")
    power = _power(par, tau, v, a, multiplier)
    # At the link, the torque limit does not include the rotor.
    rotor = par.link_side * par.rotor_inertia
    gradient, jacobian, hessian = _derivatives(power, tau, rotor, y, multiplier, weight)
    dense = ca.densify
    value = [power.cost, dense(tau - rotor * a + power.friction)]
    node = [*value, dense(gradient), dense(jacobian), dense(hessian)]
    return [
        ca.Function("torque", [y, p], [dense(tau)], {"cse": True}),
        ca.Function("value", [y, p], value, {"cse": True}),
        ca.Function("node", [y, multiplier, weight, p], node, {"cse": True}),
    ]


def _power(par: Parameters, tau: ca.SX, v: ca.SX, a: ca.SX, multiplier: ca.SX) -> _Power:
    """Cost and friction at torque tau, speed v and acceleration a.

    They are differentiated by symbols, and the expressions of tau, v and a are substituted
    afterwards.
    """
    nq = tau.numel()
    t, w, x, tau_friction = (ca.SX.sym(name, nq) for name in ("t", "w", "x", "tau_friction"))
    inner = ca.vertcat(t, w, x)
    law = friction_torque(par.friction, par.drives, t, w, x, ca)
    general_cost = _cost(par, t, w, tau_friction)
    cost, cost_by_friction = ca.substitute(
        [general_cost, ca.gradient(general_cost, tau_friction)], [tau_friction], [law]
    )
    hessian, gradient = ca.hessian(cost, inner)
    hessian[nq : 2 * nq, nq : 2 * nq] -= ca.diag(
        _reversal_concavity(par, cost_by_friction, t, w, x)
    )
    friction = (1 - par.link_side) * law
    friction_hessian, _ = ca.hessian(ca.dot(multiplier, friction), inner)
    local = [cost, friction, gradient, hessian, ca.jacobian(friction, inner), friction_hessian]
    return _Power(*ca.substitute(local, [t, w, x], [tau, v, a]))


def _reversal_concavity(
    par: Parameters, cost_by_friction: ca.SX, t: ca.SX, w: ca.SX, x: ca.SX
) -> ca.SX:
    """Negative part (nq,) of the cost's second derivatives by speed due to the smoothed reversal of
    friction.

    |v| is convex, but v² / sqrt(v² + knee²) is not beyond its knee. `cost_by_friction` (nq,) is the
    derivative of the cost by the friction torque.
    """
    dry = replace(par.friction, curved=0 * par.curved, viscous=0 * par.viscous)
    reversal = friction_torque(dry, par.drives, t, w, x, ca)
    curvature = cost_by_friction * ca.diag(ca.jacobian(ca.diag(ca.jacobian(reversal, w)), w))
    # The smaller of the curvature and zero.
    concave: ca.SX = (curvature - ca.fabs(curvature)) / 2
    return concave


def _cost(par: Parameters, t: ca.SX, w: ca.SX, tau_friction: ca.SX) -> ca.SX:
    """Smoothed cost [W] at torques t, speeds w and friction torques `tau_friction`."""
    # |i| of the inverter is smoothed over a tenth of an ampere per watt of width.
    flow = flow_with(tau_friction, t, w, par.drives, 0.1 * par.width, ca)
    shared = drawn_power(par.base_power + ca.sum1(flow.joints), par.regeneration, par.width, ca)
    # One corner per joint instead of a common one, smoothed over its share of the width.
    isolated = par.base_power + ca.sum1(drawn_power(flow.joints, 0, par.width / t.numel(), ca))
    drawn = (1 - par.isolated) * shared + par.isolated * isolated
    mechanical = ca.sum1(smooth_abs(t * w, par.width, ca))
    cost: ca.SX = par.electrical * drawn + par.mechanical * mechanical + par.time
    return cost


def _derivatives(
    power: _Power, tau: ca.SX, rotor: ca.SX, y: ca.SX, multiplier: ca.SX, weight: ca.SX
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Gradient of the cost, Jacobian of tau_limited, and Hessian of weight · cost + multiplier ·
    tau_limited, all with respect to y.

    The chain rule is applied by hand: this takes a third of the operations of differentiating the
    composed cost twice. `rotor` (nq,) [kg·m²] is the inertia that the limited torque leaves out.
    """
    nq = tau.numel()
    J_tau = ca.jacobian(tau, y)
    J_inner = ca.vertcat(J_tau, ca.horzcat(ca.SX(2 * nq, nq), ca.SX.eye(2 * nq)))
    symbolic_weights = ca.SX.sym("symbolic_weights", nq)
    tau_weights = (
        weight * power.gradient[:nq] + multiplier + power.friction_jacobian[:, :nq].T @ multiplier
    )
    dynamics_hessian = ca.substitute(
        ca.hessian(ca.dot(symbolic_weights, tau), y)[0], symbolic_weights, tau_weights
    )
    hessian = (
        dynamics_hessian
        + _congruent(J_inner, weight * power.hessian)
        + _congruent(J_inner, power.friction_hessian)
    )
    jacobian = J_tau + power.friction_jacobian @ J_inner
    jacobian[:, 2 * nq :] -= ca.diag(rotor)
    return J_inner.T @ power.gradient, jacobian, hessian


def _congruent(J: ca.SX, symmetric: ca.SX) -> ca.SX:
    """The product Jᵀ · symmetric · J: one half is computed and mirrored."""
    return ca.tril2symm(ca.tril(J.T @ (symmetric @ J)))
