"""Idle power, copper loss and inverter loss from the power of the arm's bus.

Idle power, copper, inverters and friction have similar effects on the power of slow moves, so a
short log does not separate these figures. Every figure therefore has a Gaussian prior around the
robot's own value, as wide as the range of the figure before any log. With longer logs, the data
outweigh the prior (maximum a posteriori).

Without torques, the power also determines Coulomb, viscous and load friction, offsets, rotors, and
one factor on the masses of all links. Lifting the links costs power, and lowering them returns it,
so wrong masses would make the predictions of all lifting moves too high, or too low.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.models.uncertainty.ranges import (
    P95,
    default_ranges,
    large_joints,
    lognormal,
    range_of,
)
from joulepath.optimizer.identify.arm.power_model import (
    PowerParameters,
    TorqueParts,
    bus_power,
    packed_size,
)
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    bisquare_weights,
    jackknife,
    leave_one_out,
    residual_replicates,
    solve_definite,
)
from joulepath.optimizer.identify.fits.own_ranges import (
    LINK_ERRORS,
    friction_width,
    own_range,
    rotor_width,
)
from joulepath.optimizer.identify.rows.clusters import Clusters, effective_variance


@dataclass(frozen=True)
class PowerFitSettings:
    """Settings of the fit of power figures."""

    offset_sd: float = 0.05
    """Prior standard deviation of a joint's offset over its Coulomb friction [1]."""
    known_sd: float = 1e-6
    """Prior standard deviation of a figure that counts as known [SI unit]."""
    unknown_idle_sd: float = 30.0
    """Prior standard deviation of an idle power whose own value is 0, which has no range [W]: about
    the idle power of an arm."""
    unknown_copper_sd: float = 0.5
    """Prior standard deviation of a copper loss whose own value is 0 [W/A²]: about the loss of a
    joint of an arm."""
    least_link_scale: float = 0.5
    """Smallest factor on the masses of the links [1], five standard deviations below the robot's
    own: links without a mass are no bodies, and no document of figures may have them."""
    max_idle_sds: float = 3.0
    """Distance of the idle power from the robot's own, over its standard deviation before the logs,
    above which the logged power is doubtful [1]."""
    max_iterations: int = 30
    """Largest number of Gauss-Newton steps."""
    step_tolerance: float = 1e-9
    """Step over the largest figure, at which the iteration ends [1]."""
    min_clusters: int = 3
    """Clusters below which the loss of information without one of them is not measured."""


POWER_FIT = PowerFitSettings()
FAR_IDLE = (
    "It is far from the robot's own value, {:.3g} W: check that the logged power is that of the "
    "arm's bus in W, and not that of the control box."
)


@dataclass(frozen=True, eq=False)
class PowerPrior:
    """Prior mean (p,) and precision (p, p) of the packed power figures."""

    mean: Array
    precision: Array
    known: Mask
    """Figures (p,) that count as known and keep their mean."""


def power_prior(robot: Robot, friction_known: bool, links_known: bool) -> PowerPrior:
    """Prior from the ranges of the robot's own figures.

    Args:
        robot: the robot with its own figures.
        friction_known: whether friction, rotors and offsets count as known.
        links_known: whether the masses of the links count as known.
    """
    known_sd = POWER_FIT.known_sd
    drives, nq = robot.drives, robot.nq
    idle = robot.electronics.idle_power + float(drives.inverter_constant.sum())
    idle_mean, idle_sd = _lognormal_around(
        idle, *own_range(robot, "idle_power", "electronics", "idle_power")
    )
    idle_sd = idle_sd or POWER_FIT.unknown_idle_sd
    large, small = (
        own_range(robot, each, "drives", "copper") for each in ("copper_large", "copper_small")
    )
    windings = drives.copper + drives.inverter_quadratic
    joints = zip(windings.tolist(), large_joints(robot).tolist(), strict=True)
    copper_mean, copper_sd = np.transpose(
        [_lognormal_around(own, *(large if is_large else small)) for own, is_large in joints]
    )
    copper_sd = np.where(copper_sd > 0, copper_sd, POWER_FIT.unknown_copper_sd)
    low, high = range_of("inverter_linear")
    inverter_mean = np.where(drives.inverter_linear > 0, drives.inverter_linear, (low + high) / 2)
    load_mean = np.zeros(nq)
    variance = np.zeros((packed_size(nq),) * 2)
    variance[0, 0] = idle_sd**2
    copper, inverter, _, _, rotor, load, offset = (
        np.arange(1 + k * nq, 1 + (k + 1) * nq) for k in range(7)
    )
    # the motors are of one maker: half of the variance is common to all joints
    variance[np.ix_(copper, copper)] = _half_common(copper_sd)
    variance[np.ix_(inverter, inverter)] = _half_common(np.full(nq, (high - low) / (2 * P95)))
    common, own, rotors, links, load_sd = known_sd, known_sd, known_sd, known_sd, np.zeros(nq)
    if not links_known:
        links = LINK_ERRORS.mass
    if not friction_known:
        common, own = (
            friction_width(robot, each) for each in ("friction_common", "friction_joint")
        )
        rotors = rotor_width(robot)
        if robot.friction.load is None:
            loaded = np.arange(nq) < default_ranges()["load"]["joints"]
            load_mean, load_sd = (
                loaded * each for each in _lognormal_around(1.0, *range_of("load"))
            )
    friction = np.arange(1 + 2 * nq, 1 + 4 * nq)
    variance[np.ix_(friction, friction)] = common**2 + own**2 * np.eye(2 * nq)
    variance[np.ix_(load, load)] = _half_common(load_sd) + known_sd**2 * np.eye(nq)
    variance[np.ix_(rotor, rotor)] = _half_common(np.full(nq, rotors))
    offset_sd = np.maximum(POWER_FIT.offset_sd * robot.friction.coulomb, known_sd)
    variance[offset, offset] = known_sd**2 if friction_known else offset_sd**2
    variance[-1, -1] = links**2
    mean = np.concatenate(
        [[idle_mean], copper_mean, inverter_mean, np.ones(3 * nq), load_mean, np.zeros(nq), [1.0]]
    )
    known = np.diag(variance) <= known_sd**2
    return PowerPrior(mean, np.asarray(np.linalg.inv(variance)), known)


def idle_remark(robot: Robot, found: float, prior: PowerPrior) -> str:
    """Remark on an idle power [W] far outside of the range of the robot's own; empty within it."""
    own, sd = robot.electronics.idle_power, float(np.sqrt(np.linalg.inv(prior.precision)[0, 0]))
    far = own > 0 and abs(found - prior.mean[0]) > POWER_FIT.max_idle_sds * sd
    return FAR_IDLE.format(own) if far else ""


def _lognormal_around(own: float, low: float, high: float) -> tuple[float, float]:
    """Mean and standard deviation of a figure between `low` and `high` times the robot's own."""
    middle, width = lognormal(low, high)
    mean = own * float(np.exp(middle))
    return mean, width * mean


def _half_common(sd: Array) -> Array:
    """Covariance of figures with standard deviations (nq,), half of which is common to all."""
    return np.asarray((np.outer(sd, sd) + np.diag(sd**2)) / 2)


@dataclass(frozen=True, eq=False)
class PowerFit:
    """Fitted power figures, with G clusters, p packed figures and n rows."""

    value: Array
    """Packed figures (p,)."""
    without_cluster: Array
    """Packed figures (G, p) without one cluster each."""
    row_replicates: Array
    """Packed figures (G, p) whose jackknife is the covariance due to the errors of the rows."""
    prior_covariance: Array
    """Covariance (p, p) due to the error of the prior."""
    covariance_increase: Array
    """Increase (G, p, p) of the covariance without one cluster each."""
    gain: Array
    """Change (p, n) of the figures over a change of the measured powers [1/W]."""


def fit_power(
    parts: TorqueParts,
    measured: Array,
    torque_constant: Array,
    regeneration: float,
    prior: PowerPrior,
    clusters: Clusters,
    robust: bool,
) -> PowerFit:
    """Most probable power figures.

    Args:
        parts: torque parts of the rows.
        measured: measured powers (n,) [W].
        torque_constant: torque constants (nq,) [N·m/A].
        regeneration: regained share of negative power [1].
        prior: prior of the packed figures.
        clusters: partition of the rows for the jackknife.
        robust: whether outliers have less weight.
    """
    settings = POWER_FIT
    value, weight = prior.mean, np.ones_like(measured)
    noise = effective_variance(measured, measured - measured.mean(), weight, clusters)
    least = np.zeros_like(prior.mean)
    least[-1 - parts.v.shape[1] : -1] = -np.inf  # offsets may be negative
    least[-1] = settings.least_link_scale
    for iteration in range(settings.max_iterations):
        figures = PowerParameters.unpacked(value)
        predicted, slope = bus_power(figures, parts, torque_constant, regeneration)
        residuals = measured - predicted
        if iteration:
            weight = bisquare_weights(residuals) if robust else weight
            # a mean residual is the pull of the prior, and no noise
            mean = float(weight @ residuals / max(weight.sum(), 1e-300))
            noise = effective_variance(measured, residuals - mean, weight, clusters)
        grouped = GroupedEquations.of(
            slope, residuals + slope @ value, weight / noise, clusters.of_row, clusters.count
        )
        precision, target = grouped.total(prior.precision, prior.mean)
        new = solve_definite(precision, target, least)
        change, value = float(np.abs(new - value).max()), new
        if iteration > 1 and change < settings.step_tolerance * (1 + np.abs(value).max()):
            break
    value = np.where(prior.known, prior.mean, value)
    free = value > least
    posterior = _inverse(precision, free)
    replicates = residual_replicates(grouped, value, free, prior.precision)
    return PowerFit(
        value=value,
        without_cluster=leave_one_out(grouped, value, free, prior.precision).estimates,
        row_replicates=replicates,
        prior_covariance=posterior @ prior.precision @ posterior,
        covariance_increase=_covariance_increase(
            grouped, precision, prior.precision, free, replicates - value
        ),
        gain=posterior @ (slope * (weight / noise)[:, None]).T,
    )


def _inverse(precision: Array, free: Mask) -> Array:
    """Covariance (p, p) of the `free` parameters (p,); 0 for all others."""
    covariance = np.zeros_like(precision)
    covariance[np.ix_(free, free)] = np.linalg.inv(precision[np.ix_(free, free)])
    return covariance


def _covariance_increase(
    grouped: GroupedEquations, precision: Array, prior: Array, free: Mask, errors: Array
) -> Array:
    """Increase (G, p, p) of the covariance without one group each.

    Args:
        grouped: normal equations of the G groups.
        precision: precision (p, p) of rows and prior.
        prior: precision (p, p) of the prior.
        free: estimated parameters (p,).
        errors: errors (G, p) whose jackknife is the covariance due to the rows.
    """
    if len(errors) < POWER_FIT.min_clusters:
        return np.zeros_like(grouped.gram)
    posterior = _inverse(precision, free)
    whole = jackknife(errors) + posterior @ prior @ posterior
    increase = np.zeros_like(grouped.gram)
    for k, gram in enumerate(grouped.gram):
        rest = _inverse(precision - gram, free)
        others = np.delete(errors, k, axis=0) @ precision @ rest
        increase[k] = jackknife(others) + rest @ prior @ rest - whole
    return increase
