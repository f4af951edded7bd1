"""Sensitivity of a motion's electrical energy to the figures of the arm, for an unchanged motion.

A joint takes P = u v + inverter(i) + copper i² with u = tau + friction and i = u / torque_constant,
so

    ∂P/∂u = v + (2 copper i + linear sign(i) + 2 quadratic i) / torque_constant.

Coefficients of friction change u by their own terms, the rotor inertia changes u by a, and link
parameters change u by the regressor of rigid-body torques. P is taken as linear in the figures. The
bus is not linear: a watt has the value 1 while the bus draws, and the recovered share of supply or
storage while there is a surplus. The sign of P may depend on the errors, so the expected value
counts (statistical linearisation): for a power P of mean m and standard deviation σ,

    E max(P, 0) = m Φ(m / σ) + σ φ(m / σ),      dE/dm = Φ(m / σ).

The effect of a joule more in the storage on later instants, with a full or empty storage, is left
out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from joulepath.models.robot import Array
from joulepath.models.uncertainty.parameters import PER_JOINT, count
from joulepath.models.uncertainty.spread import Spread
from joulepath.optimizer.dynamics.bus_flow import exchange
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, rigid_regressor
from joulepath.optimizer.dynamics.losses import friction_torque
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.result.energy import Sensitivity


@dataclass(frozen=True)
class SensitivitySettings:
    """Rounding in sensitivities."""

    storage_rounding: float = 1e-9
    """Largest surplus beside the storage, relative to the charged energy, that counts as zero."""
    smallest_deviation: float = 1e-9
    """Smallest standard deviation of a power [W]; a smaller one would be divided by zero."""


SENSITIVITY = SensitivitySettings()


def energy_sensitivity(
    weights: Array,
    q: Array,
    v: Array,
    a: Array,
    tau: Array,
    arm: Arm,
    spread: Spread,
    tau_friction: Array | None = None,
) -> Sensitivity:
    """Sensitivity of the energy of a motion to the errors of `spread`.

    Args:
        weights: quadrature weights (k,) [s].
        q: joint positions (k, nq) [rad].
        v: joint speeds (k, nq) [rad/s].
        a: joint accelerations (k, nq) [rad/s²].
        tau: rigid-body and rotor torques (k, nq) [N·m], without friction.
        arm: the arm.
        spread: errors of its figures.
        tau_friction: friction torques (k, nq) [N·m] if they are known already.
    """
    rates, by_link, joints = _power_rates(q, v, a, tau, arm, spread, tau_friction)
    figures, nq, size = rates.shape
    base, behind = np.full(size, arm.base_power), count(nq)
    if arm.bus.mode == "isolated":
        # By figure and joint, in the order of PER_JOINT.
        root, mean = (
            spread.root[1:behind].reshape(figures, nq, -1),
            spread.mean[1:behind].reshape(figures, nq),
        )
        means = joints + np.einsum("cjk,cj->kj", rates, mean) + by_link @ spread.mean[behind:]
        factors = (rates.transpose(1, 2, 0) @ root.transpose(1, 0, 2)).transpose(1, 0, 2)
        value, expected = _expected(means, factors + by_link @ spread.root[behind:], np.zeros(nq))
        drawn, plain = (
            base + spread.mean[0] + expected.sum(axis=1),
            base + np.maximum(joints, 0.0).sum(axis=1),
        )
        electronics, watts = np.ones(size), weights[:, None] * value
        gradient = np.append(
            np.einsum("kj,cjk->cj", watts, rates).ravel(), np.einsum("kj,kjp->p", watts, by_link)
        )
    else:
        net, recovered = base + joints.sum(axis=1), _recovered_share(arm, joints, weights)
        flat = rates.reshape(-1, size)
        if by_link.shape[2]:
            flat = np.vstack([flat, by_link.sum(axis=1).T])
        means = net + spread.mean[0] + spread.mean[1:] @ flat
        electronics, drawn = _expected(means, flat.T @ spread.root[1:] + spread.root[0], recovered)
        plain = np.maximum(net, 0.0) - recovered * np.maximum(-net, 0.0)
        gradient = flat @ (weights * electronics)
    shift = float(weights @ (drawn - plain))
    return Sensitivity(np.append(float(weights @ electronics), gradient), shift)


def waiting_sensitivity(
    arm: Arm, q: Array, tau: Array, motors: float, brakes: float, dwell: Dwell, spread: Spread
) -> Sensitivity:
    """Sensitivity of the energy of standing still at q (nq,) [rad].

    Args:
        arm: the arm.
        q: configuration (nq,) [rad].
        tau: torques (nq,) [N·m] that the motors hold.
        motors: time for which the motors hold the arm [s].
        brakes: time for which the brakes hold it [s].
        dwell: the dwell.
        spread: errors of the arm's figures.
    """
    still = np.zeros((1, len(tau)))
    rates, by_link, _ = _power_rates(q[None], still, still, tau[None], arm, spread)
    electronics = motors + (brakes if dwell.brake_power is None else 0.0)
    gradient = np.concatenate(
        [[electronics], motors * rates.ravel(), motors * by_link[0].sum(axis=0)]
    )
    return Sensitivity(gradient, float(gradient @ spread.mean))


def _expected(means: Array, factors: Array, recovered: Array) -> tuple[Array, Array]:
    """Expected value of a watt more, and expected drawn power [W].

    The powers have the given means (...) and depend on independent standard normal errors through
    `factors` (..., r); the share `recovered` of a surplus is given back.
    """
    sd = np.maximum(np.sqrt((factors * factors).sum(axis=-1)), SENSITIVITY.smallest_deviation)
    x = means / sd
    above = ndtr(x)
    positive = means * above + sd * np.exp(-x * x / 2) / np.sqrt(2 * np.pi)
    return recovered + (1 - recovered) * above, recovered * means + (1 - recovered) * positive


def _recovered_share(arm: Arm, joints: Array, weights: Array) -> Array:
    """Share (k,) of the surplus that supply or energy storage recover."""
    recovered = np.full(len(joints), arm.regeneration)
    if arm.bus.mode != "storage":
        return recovered
    flows = exchange(arm.bus, arm.regeneration, arm.base_power, joints, weights)
    return np.where(
        (flows.charged > 0) & (flows.surplus <= SENSITIVITY.storage_rounding * flows.charged),
        arm.bus.efficiency,
        recovered,
    )


def _power_rates(
    q: Array,
    v: Array,
    a: Array,
    tau: Array,
    arm: Arm,
    spread: Spread,
    tau_friction: Array | None = None,
) -> tuple[Array, Array, Array]:
    """Derivatives of the joints' power, and the power itself.

    Returns:
        Derivatives (c, nq, k) of the power of a joint by its figures in PER_JOINT, derivatives (k,
        nq, p) by the parameters of all links (p = 0 if the links are known), and the power (k, nq)
        [W].
    """
    drives, law = arm.drives, arm.friction_law
    if tau_friction is None:
        tau_friction = friction_torque(law, drives, tau, v, a)
    u = tau + tau_friction
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
    by_link = by_rigid[:, :, None] * _rates_by_links(q, v, a, arm, spread)
    # Samples are the last axis: subsequent sums run over samples, or over figures, of one joint.
    return np.array([rates[name].T for name in PER_JOINT]), by_link, joints


def _rates_by_links(q: Array, v: Array, a: Array, arm: Arm, spread: Spread) -> Array:
    """Derivatives (k, nq, p) of the rigid-body torques by the uncertain parameters of the links."""
    nq = q.shape[1]
    if len(spread.mean) == count(nq):
        return np.zeros((*q.shape, 0))
    model = arm.robot.model.copy()
    model.gravity.linear = arm.gravity
    return rigid_regressor(model, q, v, a) * np.repeat(
        np.broadcast_to(arm.link_mass_scale, nq), PARAMETERS_PER_BODY
    )
