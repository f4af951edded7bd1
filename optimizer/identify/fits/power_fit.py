"""Idle power, copper loss, inverter loss and, without torques, what makes the torques, from the
power of the arm's bus.

Idle power, copper, inverters and friction act alike on the power of slow moves, so a short log does
not tell them apart. Each is therefore held to the robot's own figure as far as that can be trusted:
a Gaussian prior with the range that the figure has before any log. What the log tells takes over as
it gets longer (maximum a posteriori).

Without torques, these are Coulomb, viscous and load friction, offsets, rotors, and the masses of
the links. The power that lifts the links comes back when they sink: wrong masses would make every
move that lifts too dear, or too cheap. All links share one factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from joulepath.models.robot import Array, Mask, Robot
from joulepath.models.trust import trust_letters
from joulepath.models.uncertainty.ranges import (
    P95,
    default_ranges,
    large_joints,
    lognormal,
    range_of,
)
from joulepath.optimizer.identify.arm.link_errors import LINK_MASS
from joulepath.optimizer.identify.arm.power_model import Electrics, Motion, packed_size, power
from joulepath.optimizer.identify.estimates.grouped import Grouped, adjusted, jackknife, left_out
from joulepath.optimizer.identify.estimates.robust import bisquare_weights
from joulepath.optimizer.identify.rows.clusters import Clusters, shared_variance

# standard deviation of a joint's offset over its Coulomb friction
OFFSET = 0.05
ITERATIONS, CONVERGED = 30, 1e-9
# standard deviation of a factor, or of load friction, that is taken as known
KNOWN = 1e-6
# groups from which on it is known what the others tell without one of them
LEAST_LOST = 3


@dataclass(frozen=True, eq=False)
class Prior:
    """Mean and precision of the packed figures before the log."""

    mean: Array
    precision: Array


def prior_of(robot: Robot, friction_known: bool) -> Prior:
    """From the ranges of the robot's own figures; with `friction_known`, all torques are taken as
    they are.
    """
    drives, nq = robot.drives, robot.nq
    idle = robot.electronics.idle_power + float(drives.inverter_constant.sum())
    idle_mean, idle_sd = _held(idle, *_range(robot, "idle_power", "electronics", "idle_power"))
    large, small = (
        _range(robot, each, "drives", "copper") for each in ("copper_large", "copper_small")
    )
    joints = zip(drives.copper.tolist(), large_joints(robot).tolist(), strict=True)
    copper_mean, copper_sd = np.transpose(
        [_held(own, *(large if is_large else small)) for own, is_large in joints]
    )
    low, high = range_of("inverter_linear")
    inverter_mean = np.where(drives.inverter_linear > 0, drives.inverter_linear, (low + high) / 2)
    load_mean = np.zeros(nq)
    variance = np.zeros((packed_size(nq),) * 2)
    variance[0, 0] = idle_sd**2
    copper, inverter, _, _, rotor, load, offset = (
        np.arange(1 + k * nq, 1 + (k + 1) * nq) for k in range(7)
    )
    # all joints have motors of one maker: half of the variance is common to them
    variance[np.ix_(copper, copper)] = _half_common(copper_sd)
    variance[np.ix_(inverter, inverter)] = _half_common(np.full(nq, (high - low) / (2 * P95)))
    common, own, rotors, links, load_sd = KNOWN, KNOWN, KNOWN, KNOWN, np.zeros(nq)
    if not friction_known:
        common, own = (_width(robot, each) for each in ("friction_common", "friction_joint"))
        links, rotors = (
            LINK_MASS,
            lognormal(*_range(robot, "rotor_inertia", "drives", "rotor_inertia"))[1],
        )
        if robot.friction.load is None:
            loaded = np.arange(nq) < default_ranges()["load"]["joints"]
            load_mean, load_sd = (loaded * each for each in _held(1.0, *range_of("load")))
    friction = np.arange(1 + 2 * nq, 1 + 4 * nq)
    variance[np.ix_(friction, friction)] = common**2 + own**2 * np.eye(2 * nq)
    variance[np.ix_(load, load)] = _half_common(load_sd) + KNOWN**2 * np.eye(nq)
    variance[np.ix_(rotor, rotor)] = _half_common(np.full(nq, rotors))
    variance[offset, offset] = (
        KNOWN**2 if friction_known else np.maximum(OFFSET * robot.friction.coulomb, KNOWN) ** 2
    )
    variance[-1, -1] = links**2
    mean = np.concatenate(
        [[idle_mean], copper_mean, inverter_mean, np.ones(3 * nq), load_mean, np.zeros(nq), [1.0]]
    )
    return Prior(mean, np.asarray(np.linalg.inv(variance)))


def _range(robot: Robot, name: str, section: str, figure: str) -> tuple[float, float]:
    """The range of a factor on a figure of the robot."""
    return range_of(name, trust_letters(robot.figures.get(section, {}).get(figure)))


def _held(own: float, low: float, high: float) -> tuple[float, float]:
    """Mean and standard deviation of a figure that is `low` to `high` times the robot's own."""
    middle, width = lognormal(low, high)
    mean = own * float(np.exp(middle))
    return mean, width * mean


def _width(robot: Robot, name: str) -> float:
    """Relative standard deviation of the friction."""
    letters = trust_letters(robot.figures.get("friction_laws", {}).get(robot.friction.name))
    return lognormal(*range_of(name, letters))[1]


def _half_common(sd: Array) -> Array:
    return np.asarray((np.outer(sd, sd) + np.diag(sd**2)) / 2)


@dataclass(frozen=True, eq=False)
class PowerFit:
    """Packed figures (p,), those (G, p) without each cluster, and `adjusted` ones (G, p), whose
    jackknife is the error by the rows. `drift` (p, p) is the covariance that the prior's own error
    adds, `lost` (G, p, p) what leaving each cluster out adds. `gain` (p, n) is by how much the
    figures change for a change of the measured powers."""

    value: Array
    without: Array
    adjusted: Array
    drift: Array
    lost: Array
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
    least = np.zeros_like(prior.mean)
    least[-1 - motion.v.shape[1] : -1] = -np.inf  # offsets
    for iteration in range(ITERATIONS):
        predicted, slope = power(Electrics.unpacked(value), motion, constant, regeneration)
        residuals = measured - predicted
        if iteration:
            weight = bisquare_weights(residuals) if robust else weight
            noise = shared_variance(residuals, weight, clusters)
        grouped = Grouped.of(
            slope, residuals + slope @ value, weight / noise, clusters.of_row, clusters.count
        )
        precision = grouped.gram.sum(axis=0) + prior.precision
        target = grouped.moment.sum(axis=0) + prior.precision @ prior.mean
        lower = np.linalg.cholesky(precision)
        new = lsq_linear(
            lower.T, np.linalg.solve(lower, target), bounds=(least, np.inf), method="bvls"
        ).x
        change, value = float(np.abs(new - value).max()), new
        if iteration > 1 and change < CONVERGED * (1 + np.abs(value).max()):
            break
    free = value > least
    posterior = _inverse(precision, free)
    spread = adjusted(grouped, value, free, prior.precision)
    return PowerFit(
        value=value,
        without=left_out(grouped, value, free, prior.precision),
        adjusted=spread,
        drift=posterior @ prior.precision @ posterior,
        lost=_lost(grouped, precision, prior.precision, free, spread - value),
        gain=posterior @ (slope * (weight / noise)[:, None]).T,
    )


def _inverse(precision: Array, free: Mask) -> Array:
    """The covariance (p, p) of parameters of which those that are not `free` are fixed."""
    covariance = np.zeros_like(precision)
    covariance[np.ix_(free, free)] = np.linalg.inv(precision[np.ix_(free, free)])
    return covariance


def _lost(grouped: Grouped, precision: Array, prior: Array, free: Mask, errors: Array) -> Array:
    """What leaving each group out adds (G, p, p) to the covariance by the rows' `errors` (G, p) and
    by the prior's.
    """
    if len(errors) < LEAST_LOST:
        return np.zeros_like(grouped.gram)
    posterior = _inverse(precision, free)
    whole = jackknife(errors) + posterior @ prior @ posterior
    lost = np.zeros_like(grouped.gram)
    for k, gram in enumerate(grouped.gram):
        rest = _inverse(precision - gram, free)
        others = np.delete(errors, k, axis=0) @ precision @ rest
        lost[k] = jackknife(others) + rest @ prior @ rest - whole
    return lost
