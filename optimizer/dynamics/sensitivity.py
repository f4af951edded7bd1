"""How a motion's electrical energy hangs on the figures of the arm; the motion stays the same.

A joint takes P = u v + inverter(i) + copper i² with u = tau + friction and i = u / torque_constant,
so that

    ∂P/∂u = v + (2 copper i + linear sign(i) + 2 quadratic i) / torque_constant.

Friction's coefficients change u by their own terms, the rotor's inertia by a, and the links'
parameters by the regressor of the rigid bodies' torques. P is taken as linear in the figures. The
bus is not: a watt is worth 1 while the bus draws, and what the supply or the energy storage takes
of it while there is a surplus. Where errors of the figures decide which it is, the expected worth
counts (statistical linearisation): with a power P of mean m and standard deviation σ,

    E max(P, 0) = m Φ(m / σ) + σ φ(m / σ),      dE/dm = Φ(m / σ).

What a joule more in the storage changes later on, where it is full or empty, is left out.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from joulepath.models.robot import Array
from joulepath.models.uncertainty.parameters import PER_JOINT, count
from joulepath.models.uncertainty.spread import Spread
from joulepath.optimizer.dynamics.bus_flow import exchange
from joulepath.optimizer.dynamics.link_regressor import BODY, rigid_regressor
from joulepath.optimizer.dynamics.losses import friction_torque
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.result.energy import Sensitivity

# of a surplus that is stored, the storage takes all but rounding
_STORED = 1e-9
# standard deviation of a power that counts as none [W]
_CERTAIN = 1e-9


def energy_sensitivity(
    weights: Array,
    q: Array,
    v: Array,
    a: Array,
    tau: Array,
    arm: Arm,
    spread: Spread,
    lost: Array | None = None,
) -> Sensitivity:
    """That of a motion to the errors of `spread`; q (k, nq) [rad], the other arguments as in
    `losses.breakdown`.
    """
    rates, by_link, joints = _power_rates(q, v, a, tau, arm, spread, lost)
    figures, nq, size = rates.shape
    base, behind = np.full(size, arm.base_power), count(nq)
    if arm.bus.mode == "isolated":
        # by figure and joint, as PER_JOINT orders them
        root, mean = (
            spread.root[1:behind].reshape(figures, nq, -1),
            spread.mean[1:behind].reshape(figures, nq),
        )
        means = joints + np.einsum("cjk,cj->kj", rates, mean) + by_link @ spread.mean[behind:]
        factors = (rates.transpose(1, 2, 0) @ root.transpose(1, 0, 2)).transpose(1, 0, 2)
        worth, expected = _expected(means, factors + by_link @ spread.root[behind:], np.zeros(nq))
        drawn, plain = (
            base + spread.mean[0] + expected.sum(axis=1),
            base + np.maximum(joints, 0.0).sum(axis=1),
        )
        electronics, watts = np.ones(size), weights[:, None] * worth
        gradient = np.append(
            np.einsum("kj,cjk->cj", watts, rates).ravel(), np.einsum("kj,kjp->p", watts, by_link)
        )
    else:
        net, taken = base + joints.sum(axis=1), _taken(arm, joints, weights)
        flat = rates.reshape(-1, size)
        if by_link.shape[2]:
            flat = np.vstack([flat, by_link.sum(axis=1).T])
        means = net + spread.mean[0] + spread.mean[1:] @ flat
        electronics, drawn = _expected(means, flat.T @ spread.root[1:] + spread.root[0], taken)
        plain = np.maximum(net, 0.0) - taken * np.maximum(-net, 0.0)
        gradient = flat @ (weights * electronics)
    shift = float(weights @ (drawn - plain))
    return Sensitivity(np.append(float(weights @ electronics), gradient), shift)


def waiting_sensitivity(
    arm: Arm, q: Array, tau: Array, motors: float, brakes: float, dwell: Dwell, spread: Spread
) -> Sensitivity:
    """That of standing still at q (nq,) [rad]: for so long [s] while motors hold torques tau (nq,)
    [N·m], then by brakes."""
    still = np.zeros((1, len(tau)))
    rates, by_link, _ = _power_rates(q[None], still, still, tau[None], arm, spread)
    electronics = motors + (brakes if dwell.brake_power is None else 0.0)
    gradient = np.concatenate(
        [[electronics], motors * rates.ravel(), motors * by_link[0].sum(axis=0)]
    )
    return Sensitivity(gradient, float(gradient @ spread.mean))


def _expected(means: Array, factors: Array, taken: Array) -> tuple[Array, Array]:
    """What a watt more is worth, and the drawn power [W], both expected: of powers with these
    means, and independent standard normal factors (..., r), of whose surplus the share `taken` is
    given back."""
    sd = np.maximum(np.sqrt((factors * factors).sum(axis=-1)), _CERTAIN)
    x = means / sd
    above = ndtr(x)
    positive = means * above + sd * np.exp(-x * x / 2) / np.sqrt(2 * np.pi)
    return taken + (1 - taken) * above, taken * means + (1 - taken) * positive


def _taken(arm: Arm, joints: Array, weights: Array) -> Array:
    """The share (k,) of the surplus that supply or energy storage take."""
    taken = np.full(len(joints), arm.regeneration)
    if arm.bus.mode != "storage":
        return taken
    flows = exchange(arm.bus, arm.regeneration, arm.base_power, joints, weights)
    return np.where(
        (flows.charged > 0) & (flows.surplus <= _STORED * flows.charged), arm.bus.efficiency, taken
    )


def _power_rates(
    q: Array, v: Array, a: Array, tau: Array, arm: Arm, spread: Spread, lost: Array | None = None
) -> tuple[Array, Array, Array]:
    """Derivatives (c, nq, k) of each joint's power by its figures in PER_JOINT, those (k, nq, p) by
    the parameters of all links, of which p = 0 have errors where the links are known, and the power
    (k, nq) itself [W]."""
    drives, law = arm.drives, arm.friction_law
    if lost is None:
        lost = friction_torque(law, drives, tau, v, a)
    u = tau + lost
    i = u / drives.torque_constant
    size, square = np.abs(i), i * i
    linear, quadratic = drives.inverter_linear, drives.copper + drives.inverter_quadratic
    joints = u * v + quadratic * square + linear * size + drives.inverter_constant
    by_torque = v + (2 * quadratic * i + linear * np.sign(i)) / drives.torque_constant
    relative, tau_rigid = v / law.speed, tau - drives.rotor_inertia * a
    viscous = by_torque * v
    step = viscous / np.sqrt(v * v + law.knee * law.knee)
    by_rigid = by_torque if law.load is None else by_torque + law.load * step * np.sign(tau_rigid)
    rates = {
        "coulomb": step,
        "curved": by_torque * np.arcsinh(relative),
        "speed": -law.curved / law.speed**2 * viscous / np.sqrt(1 + relative * relative),
        "viscous": viscous,
        "load": step * np.abs(tau_rigid),
        "torque_constant": -(2 * quadratic * square + linear * size) / drives.torque_constant,
        "rotor_inertia": by_torque * a,
        "copper": square,
        "inverter_constant": np.ones_like(v),
        "inverter_linear": size,
        "inverter_quadratic": square,
    }
    by_link = by_rigid[:, :, None] * _of_links(q, v, a, arm, spread)
    # samples last: what follows sums over them, or over the figures, of one joint
    return np.array([rates[name].T for name in PER_JOINT]), by_link, joints


def _of_links(q: Array, v: Array, a: Array, arm: Arm, spread: Spread) -> Array:
    """Derivatives (k, nq, p) of the rigid bodies' torques by the links' parameters that have
    errors.
    """
    nq = q.shape[1]
    if len(spread.mean) == count(nq):
        return np.zeros((*q.shape, 0))
    model = arm.robot.model.copy()
    model.gravity.linear = arm.gravity
    return rigid_regressor(model, q, v, a) * np.repeat(
        np.broadcast_to(arm.link_mass_scale, nq), BODY
    )
