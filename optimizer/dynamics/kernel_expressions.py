"""The per-node functions of the NLP as CasADi expressions, and their parameters."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from joulepath.models.robot import Array, Drives, FrictionLaw, Robot
from joulepath.optimizer.dynamics.inverse_dynamics import SymbolicPayload, inverse_dynamics
from joulepath.optimizer.dynamics.losses import drawn_power, flow_with, friction_torque, smooth_abs

# Held while expressions are built, turned into functions, mapped or freed. CasADi works on them
# without Python's global lock, all expressions share constants and caches, and only some of its
# builds guard these against other threads. Evaluating a function needs no lock, as long as every
# thread has a buffer of its own.
SYMBOLICS = threading.RLock()

# fields of `Parameters` that are one number; those of other sizes than one number per joint
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
    """Everything that a request may change, in the order in which the compiled functions take it.

    The payload: `mass` [kg], `com` (3,) [m] in the flange frame, `inertia` (6,) ixx ixy ixz iyy iyz
    izz about the com [kg·m²]. `gravity` (3,) [m/s²] in the base frame. Per joint (nq,):
    `rotor_inertia` [kg·m²]; friction `coulomb`, `curved` [N·m], `speed` [rad/s], `viscous`
    [N·m·s/rad], `load` [1]; drives `torque_constant` [N·m/A], `copper` [W/A²], `inverter_constant`
    [W], `inverter_linear` [W/A], `inverter_quadratic` [W/A²]; `link_mass_scale` [1].

    `link_side` is 1 if the limited torque is that of the link, 0 if that of the motor. `base_power`
    [W] of the electronics; `regeneration` [1], the fraction of net surplus that the supply takes
    back; `isolated` is 1 if every joint dissipates its own surplus, else 0. `electrical`,
    `mechanical` [1] and `time` [W] weigh the parts of the cost. `knee` [rad/s] smooths the reversal
    of friction, `bend` (nq,) [N·m] the corner of its growth with the load, `width` [W] the corners
    of the cost. `load` is None in a kernel without such friction.
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
        """The friction law of these coefficients."""
        law = FrictionLaw(
            "symbolic", self.coulomb, self.curved, self.speed, self.viscous, self.knee
        )
        return law if self.load is None else replace(law, load=self.load, bend=self.bend)

    @property
    def drives(self) -> Drives:
        """The drives of these coefficients; the gear ratio plays no part."""
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
    """The cost and the friction in the limited torque, as functions of the torque tau (nq,) [N·m],
    the speed v (nq,) [rad/s] and the acceleration a (nq,) [rad/s²] alone.

    `slope` (3 nq,) and `bend` (3 nq, 3 nq) are the cost's derivatives by tau, v and a;
    `friction_slope` (nq, 3 nq) is that of the friction, `friction_bend` (3 nq, 3 nq) the second one
    of multiplier · friction.
    """

    cost: ca.SX
    friction: ca.SX
    slope: ca.SX
    bend: ca.SX
    friction_slope: ca.SX
    friction_bend: ca.SX


def sizes(nq: int) -> dict[str, tuple[tuple[int, ...], tuple[int, ...]]]:
    """How many numbers each argument and each result of the functions of an arm of nq joints has,
    by function.
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
    """The functions of a robot as CasADi expressions.

    `torque`(y, p) → tau: rigid body and rotor torque [N·m]. `value`(y, p) → cost [W], tau_limited
    [N·m]: the torque that is limited, see `limited_torque`. `node`(y, multiplier, weight, p) →
    cost, tau_limited, gradient of the cost, Jacobian of tau_limited (nq, 3 nq), and the Hessian (3
    nq, 3 nq) of weight · cost + multiplier · tau_limited, without what the smoothed reversal of
    friction makes concave. y = (q, v, a) stacked.
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
        robot.model, q, v, a, par.payload, par.gravity, par.rotor_inertia, par.link_mass_scale
    )
    multiplier, weight = ca.SX.sym("multiplier", nq), ca.SX.sym("weight")
    power = _power(par, tau, v, a, multiplier)
    # on the link's side without the rotor
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
    """Cost and friction at torque tau, speed v and acceleration a, differentiated before these are
    put in.
    """
    nq = tau.numel()
    t, w, x, lost = (ca.SX.sym(name, nq) for name in ("t", "w", "x", "lost"))
    inner = ca.vertcat(t, w, x)
    law = friction_torque(par.friction, par.drives, t, w, x, ca)
    by_friction = _cost(par, t, w, lost)
    cost, worth = ca.substitute([by_friction, ca.gradient(by_friction, lost)], [lost], [law])
    bend, slope = ca.hessian(cost, inner)
    bend[nq : 2 * nq, nq : 2 * nq] -= ca.diag(_concave(par, worth, t, w, x))
    friction = (1 - par.link_side) * law
    friction_bend, _ = ca.hessian(ca.dot(multiplier, friction), inner)
    local = [cost, friction, slope, bend, ca.jacobian(friction, inner), friction_bend]
    return _Power(*ca.substitute(local, [t, w, x], [tau, v, a]))


def _concave(par: Parameters, worth: ca.SX, t: ca.SX, w: ca.SX, x: ca.SX) -> ca.SX:
    """What the smoothed reversal of friction takes from the cost's second derivatives by speed
    (nq,), where it does.

    |v| is convex, v² / sqrt(v² + knee²) is not beyond its knee. `worth` (nq,) is the cost's
      derivative by friction.
    """
    dry = replace(par.friction, curved=0 * par.curved, viscous=0 * par.viscous)
    reversal = friction_torque(dry, par.drives, t, w, x, ca)
    curvature = worth * ca.diag(ca.jacobian(ca.diag(ca.jacobian(reversal, w)), w))
    # the least of this and zero
    concave: ca.SX = (curvature - ca.fabs(curvature)) / 2
    return concave


def _cost(par: Parameters, t: ca.SX, w: ca.SX, lost: ca.SX) -> ca.SX:
    """Smoothed cost [W] for torques t, speeds w and friction torques `lost`."""
    # the inverter's |i| is smoothed over a tenth of an ampere per watt of width
    flow = flow_with(lost, t, w, par.drives, 0.1 * par.width, ca)
    shared = drawn_power(par.base_power + ca.sum1(flow.joints), par.regeneration, par.width, ca)
    # one corner per joint instead of one for all: each is smoothed over its share of the width
    isolated = par.base_power + ca.sum1(drawn_power(flow.joints, 0, par.width / t.numel(), ca))
    drawn = (1 - par.isolated) * shared + par.isolated * isolated
    mechanical = ca.sum1(smooth_abs(t * w, par.width, ca))
    cost: ca.SX = par.electrical * drawn + par.mechanical * mechanical + par.time
    return cost


def _derivatives(
    power: _Power, tau: ca.SX, rotor: ca.SX, y: ca.SX, multiplier: ca.SX, weight: ca.SX
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Gradient of the cost, Jacobian of tau_limited, and Hessian of weight · cost + multiplier ·
    tau_limited, all by y.

    `rotor` (nq,) [kg·m²] is the inertia that the limited torque leaves out. The chain rule is
    applied by hand: it takes a third of the operations that differentiating the composed cost twice
    takes.
    """
    nq = tau.numel()
    J_tau = ca.jacobian(tau, y)
    J_inner = ca.vertcat(J_tau, ca.horzcat(ca.SX(2 * nq, nq), ca.SX.eye(2 * nq)))
    pull = ca.SX.sym("pull", nq)
    pulled = weight * power.slope[:nq] + multiplier + power.friction_slope[:, :nq].T @ multiplier
    dynamics_bend = ca.substitute(ca.hessian(ca.dot(pull, tau), y)[0], pull, pulled)
    hessian = (
        dynamics_bend
        + _congruent(J_inner, weight * power.bend)
        + _congruent(J_inner, power.friction_bend)
    )
    jacobian = J_tau + power.friction_slope @ J_inner
    jacobian[:, 2 * nq :] -= ca.diag(rotor)
    return J_inner.T @ power.slope, jacobian, hessian


def _congruent(J: ca.SX, symmetric: ca.SX) -> ca.SX:
    """Jᵀ · symmetric · J: half of the product, mirrored."""
    return ca.tril2symm(ca.tril(J.T @ (symmetric @ J)))
