"""Idle power, copper loss, inverter loss and, without torques, friction from the power of the arm's bus.

Idle power, copper, inverters and friction act alike on the power of slow moves, so a short log does not tell them
apart. Each is therefore held to the robot's own figure as far as that can be trusted: a Gaussian prior with the range
that the figure has before any log. What the log tells takes over as it gets longer (maximum a posteriori).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from models.robot import Array, Mask, Robot
from models.uncertainty.spread import P95
from optimizer.identification.clusters import Clusters, shared_variance
from optimizer.identification.grouped import Grouped, left_out
from optimizer.identification.power_model import Electrics, Motion, power
from optimizer.identification.robust import bisquare_weights

# P95 over the value of the robot's own figures before any log, from the spread over units and temperatures
IDLE, COPPER, FRICTION_COMMON, FRICTION_JOINT = 1.28, 2.5, 1.22, 1.28
# P95 [W/A] of the inverter's linear loss where the robot has no figure, and P5 is 0
INVERTER = 0.3
ITERATIONS, CONVERGED = 30, 1e-9
WORTH = 0.7
"""A posterior standard deviation above this share of the prior's: the log did not tell the figure."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Mean and precision of the packed figures before the log."""

    mean: Array
    precision: Array


def prior_of(robot: Robot, friction_known: bool) -> Prior:
    """From the robot's own figures; with `friction_known` the friction factor is 1."""
    drives, nq = robot.drives, robot.nq
    idle = robot.electronics.idle_power + float(drives.inverter_constant.sum())
    inverters = np.where(drives.inverter_linear > 0, drives.inverter_linear, INVERTER / 2)
    mean = np.concatenate([[idle], drives.copper, inverters, np.ones(nq)])
    variance = np.zeros((len(mean), len(mean)))
    variance[0, 0] = (np.log(IDLE) / P95 * idle) ** 2
    copper, inverter, factor = (np.arange(1 + k * nq, 1 + (k + 1) * nq) for k in range(3))
    # all joints have motors of one maker: half of the variance is common to them
    variance[np.ix_(copper, copper)] = _half_common(np.log(COPPER) / P95 * drives.copper)
    variance[np.ix_(inverter, inverter)] = _half_common(np.full(nq, INVERTER / (2 * P95)))
    common, own = (1e-6, 1e-6) if friction_known else (np.log(FRICTION_COMMON) / P95, np.log(FRICTION_JOINT) / P95)
    variance[np.ix_(factor, factor)] = common**2 + own**2 * np.eye(nq)
    return Prior(mean, np.asarray(np.linalg.inv(variance)))


def _half_common(sd: Array) -> Array:
    return np.asarray((np.outer(sd, sd) + np.diag(sd**2)) / 2)


@dataclass(frozen=True, eq=False)
class PowerFit:
    """Packed figures (p,) and those (G, p) without each cluster. `drift` (p, p) is the covariance that the prior's own
    error adds. `gain` (p, n) is by how much the figures change for a change of the measured powers."""

    value: Array
    replicates: Array
    drift: Array
    gain: Array


def fit_power(
    motion: Motion,
    measured: Array,
    constant: Array,
    regeneration: float,
    prior: Prior,
    clusters: Clusters,
    robust: bool,
) -> PowerFit:
    """The most probable figures for powers `measured` (n,) [W].

    `constant` (nq,) [N·m/A] are torque constants. `robust`: outliers have less weight.
    """
    value, weight, noise = prior.mean, np.ones_like(measured), float(np.var(measured)) + 1e-9
    held = _unmoved(motion)
    for iteration in range(ITERATIONS):
        predicted, slope = power(Electrics.unpacked(value), motion, constant, regeneration)
        residuals = measured - predicted
        if iteration:
            weight = bisquare_weights(residuals) if robust else weight
            noise = shared_variance(residuals, weight, clusters)
        grouped = Grouped.of(slope, residuals + slope @ value, weight / noise, clusters.of_row, clusters.count)
        precision = grouped.gram.sum(axis=0) + prior.precision
        target = grouped.moment.sum(axis=0) + prior.precision @ prior.mean
        new = _nonnegative(precision, target, prior.mean, held)
        change, value = float(np.abs(new - value).max()), new
        if iteration > 1 and change < CONVERGED * (1 + np.abs(value).max()):
            break
    free = ~held & (value > 0)
    posterior = np.zeros_like(precision)
    posterior[np.ix_(free, free)] = np.linalg.inv(precision[np.ix_(free, free)])
    return PowerFit(
        value=value,
        replicates=left_out(grouped, value, free, prior.precision),
        drift=posterior @ prior.precision @ posterior,
        gain=posterior @ (slope * (weight / noise)[:, None]).T,
    )


def _unmoved(motion: Motion) -> Mask:
    """The packed figures of joints that do not move: the robot's own are kept, apart from copper and inverter."""
    still = np.abs(motion.v).max(axis=0) < 1e-3
    none = np.zeros_like(still)
    return np.concatenate([[False], none, none, still])


def _nonnegative(precision: Array, target: Array, own: Array, held: Mask) -> Array:
    """The x ≥ 0 that minimises xᵀ precision x / 2 - targetᵀ x, the held ones as they are."""
    free = np.flatnonzero(~held)
    part, rest = precision[np.ix_(free, free)], target[free] - precision[np.ix_(free, np.flatnonzero(held))] @ own[held]
    lower = np.linalg.cholesky(part)
    found = own.copy()
    found[free] = lsq_linear(lower.T, np.linalg.solve(lower, rest), bounds=(0.0, np.inf), method="bvls").x
    return found
