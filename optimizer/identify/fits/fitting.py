"""One fit: from rows of logs to an arm with fitted figures and their uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.spread import root_of
from joulepath.optimizer.dynamics.link_regressor import body_parameters
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm, own_arm, with_torques
from joulepath.optimizer.identify.arm.power_model import PowerParameters, packed_size
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name, join_estimates
from joulepath.optimizer.identify.fits.base_fit import BaseTerms, fit_base
from joulepath.optimizer.identify.fits.base_wrench import fit_wrench
from joulepath.optimizer.identify.fits.block import TorqueData, terms_of
from joulepath.optimizer.identify.fits.determined import DETERMINED, with_reasons
from joulepath.optimizer.identify.fits.link_side import (
    kept_drives,
    seen_behind_gears,
    sensor_of,
    sensor_options,
    with_doubts_about_side,
)
from joulepath.optimizer.identify.fits.periodic import fit_periodic
from joulepath.optimizer.identify.fits.power_fit import (
    PowerFit,
    PowerPrior,
    fit_power,
    idle_remark,
    power_prior,
)
from joulepath.optimizer.identify.fits.torque_fit import fit_torques
from joulepath.optimizer.identify.fits.whole_fit import LINK_NAMES, fit_whole
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import MeasuredNoise
from joulepath.optimizer.identify.rows.clusters import Clusters, clusters_of
from joulepath.optimizer.identify.rows.fit_rows import Rows

LINK_MASS_SCALE = "link_mass_scale"
"""Name of the factor on the masses of all links."""
HARDLY_KNOWN = "The logs hardly determine it better than the range of the robot's own value."


@dataclass(frozen=True)
class FitSettings:
    """Settings of the uncertainty of a fit."""

    min_error_share: float = 1e-3
    """Variance of a common error of parameters of unit size over the largest one, up to which the
    error is a rounding error [1]."""
    min_factor: float = 1e-3
    """Smallest factor on friction or rotors by which covariances are scaled [1]."""


FIT = FitSettings()


@dataclass(frozen=True, eq=False)
class FitResult:
    """Fitted arm and its uncertainty, with G clusters and p packed power parameters.

    The jackknife of the `row_error_arms` is the uncertainty due to the errors of the rows. The fit
    also depends on figures of the robot that it does not change: each of the `prior_error_arms` has
    one independent error of these, in its torques and in its power parameters.
    """

    arm: FittedArm
    estimate: Estimate
    clusters: Clusters
    arms_without_cluster: tuple[FittedArm, ...]
    """Arms (G,) fitted without one cluster each."""
    row_error_arms: tuple[FittedArm, ...]
    """Arms (G,) whose jackknife is the error of the fit by the errors of the rows."""
    prior_error_arms: tuple[FittedArm, ...]
    """Arms with one independent error of the assumed figures each."""
    prior_covariance: Array
    """Covariance (p, p) of the power parameters due to their own prior."""
    covariance_increase: Array
    """Increase (G, p, p) of the covariance of the power parameters without one cluster each."""
    mean_power: float
    """Mean power of the rows [W]; NaN without power."""
    noise: MeasuredNoise | None = None
    """Noise of a periodic motion; None for other methods."""
    thresholds: Array | None = None
    """Speeds (nq,) below which no sample of a joint was used [rad/s]; None for other methods."""


def fit_rows(robot: Robot, rows: Rows, options: IdentificationOptions) -> FitResult:
    """Fit the logged channels: torques, power or both; or the wrench beneath the base."""
    clusters, arm = clusters_of(rows), own_arm(robot, options.knee)
    torque, with_power = arm.logged_torque(rows), bool(np.isfinite(rows.power).any())
    size = packed_size(robot.nq)
    moving_power = rows.power[np.isfinite(rows.power) & ~rows.rest]
    fitted = FitResult(
        arm=arm,
        estimate=join_estimates([]),
        clusters=clusters,
        arms_without_cluster=(arm,) * clusters.count,
        row_error_arms=(arm,) * clusters.count,
        prior_error_arms=(),
        prior_covariance=np.zeros((size, size)),
        covariance_increase=np.zeros((clusters.count, size, size)),
        mean_power=float(np.mean(moving_power)) if moving_power.size else np.nan,
    )
    if options.method == "base_wrench":
        links = body_parameters(robot.model)
        found = fit_wrench(robot, rows, clusters, options)
        return _with_estimate(fitted, found, lambda x: replace(arm, link_change=x - links))[0]
    errors = np.zeros((0, 0))
    if np.isfinite(torque).any() and (options.needs_regressor or terms_of(options)):
        fitted, errors = _with_torque(robot, rows, torque, fitted, options)
    if with_power:
        return _with_power(robot, rows, fitted, errors, options)
    if rows.link_side:
        kept = kept_drives(robot, clusters.count, options)
        return replace(fitted, estimate=join_estimates([fitted.estimate, kept]))
    return fitted


def _with_torque(
    robot: Robot, rows: Rows, torque: Array, fitted: FitResult, options: IdentificationOptions
) -> tuple[FitResult, Array]:
    """The fit with torques, and the errors (k, p) of the parameters of its `prior_error_arms`."""
    own, own_robot, noise = fitted.arm, robot, None
    if rows.link_side:
        robot, options = seen_behind_gears(robot), sensor_options(rows, torque, options)
    data = TorqueData(robot, rows, torque, fitted.clusters, options)
    if options.method == "periodic":
        found, noise = fit_periodic(data)
    else:
        fit = fit_whole if options.refit else fit_base if options.reduced else fit_torques
        found = fit(data)
    if rows.link_side:
        found = with_doubts_about_side(found, own_robot)
    of_links = np.array([joint is None or name in LINK_NAMES for name, joint in found.names])
    named = zip(found.names, found.reasons, of_links.tolist(), strict=True)
    terms = {name: reason for name, reason, of_link in named if not of_link}
    matrix, before = _link_changes(robot, options)

    def arm(values: Array) -> FittedArm:
        if rows.link_side:
            changed = replace(
                own, sensor=sensor_of(robot.nq, [*terms], values[~of_links], options.reversal)
            )
        else:
            changed = with_torques(own, terms, values[~of_links], tuple(options.couplings))
        if not of_links.any():
            return changed
        return replace(changed, link_change=matrix @ (values[of_links] - before))

    result, errors = _with_estimate(fitted, found, arm)
    return replace(result, noise=noise), errors


def _with_estimate(
    fitted: FitResult, found: Estimate, arm: Callable[[Array], FittedArm]
) -> tuple[FitResult, Array]:
    """The fit with an estimate, and the errors (k, p) of the parameters of its `prior_error_arms`.

    Args:
        fitted: the fit before.
        found: estimate of p parameters.
        arm: the arm with some values (p,) of the parameters.
    """
    errors = root_of(found.prior_covariance, FIT.min_error_share).T
    without = tuple(arm(values) for values in found.replicates)
    result = replace(
        fitted,
        arm=arm(found.value),
        estimate=found,
        arms_without_cluster=without,
        row_error_arms=without,
        prior_error_arms=tuple(arm(found.value + error) for error in errors),
    )
    return result, errors


def _link_changes(robot: Robot, options: IdentificationOptions) -> tuple[Array, Array]:
    """Matrix (10 nq, k) from changes of the links' unknowns to changes of bodies, and the robot's
    own values (k,) of the unknowns."""
    links = body_parameters(robot.model)
    if not options.reduced:
        return np.eye(len(links)), links
    terms = BaseTerms.of(robot, [], options)
    return terms.body_changes(len(links)), terms.own[: len(terms.expressed)]


def _with_power(
    robot: Robot, rows: Rows, fitted: FitResult, errors: Array, options: IdentificationOptions
) -> FitResult:
    """The fit with power.

    Args:
        robot: the robot with its own figures.
        rows: rows with power.
        fitted: the fit of torques.
        errors: errors (k, p) of the parameters of the `prior_error_arms`.
        options: requested figures.
    """
    use, clusters, arm = np.isfinite(rows.power), fitted.clusters, fitted.arm
    part, of_row = rows.take(use), Clusters(clusters.of_row[use], clusters.count)
    torque_known = len(fitted.estimate.names) > 0
    friction_known = torque_known and not rows.link_side
    prior = power_prior(robot, friction_known, links_known=torque_known)
    fit = fit_power(
        arm.torque_parts(part),
        part.power,
        arm.torque_constant,
        arm.regeneration,
        prior,
        of_row,
        options.estimator == "irls",
    )
    others = fitted.arms_without_cluster if torque_known else ()
    moved = _parameter_changes(fit, arm, part, (*others, *fitted.prior_error_arms))
    shifts = moved[len(others) :]
    by_torques = moved[: len(others)] if torque_known else 0.0
    without, by_rows = fit.without_cluster + by_torques, fit.row_replicates + by_torques
    matrix, constant, names = _figures_of_power(robot, prior, friction_known, torque_known)
    estimate = _with_hardly_known(
        Estimate(
            names,
            matrix @ fit.value + constant,
            by_rows @ matrix.T + constant,
            (),
            matrix @ (fit.prior_covariance + shifts.T @ shifts) @ matrix.T,
            (idle_remark(robot, float(fit.value[0]), prior), *[""] * (len(names) - 1)),
        ),
        matrix @ np.linalg.inv(prior.precision) @ matrix.T,
    )
    relative = _covariance_scale(robot.nq, fit.value)
    return replace(
        fitted,
        arm=_with_parameters(arm, fit.value, friction_known),
        estimate=join_estimates(
            [fitted.estimate, estimate], errors.T @ shifts @ matrix.T if torque_known else None
        ),
        arms_without_cluster=_each_with_parameters(
            fitted.arms_without_cluster, without, friction_known
        ),
        row_error_arms=_each_with_parameters(fitted.row_error_arms, by_rows, friction_known),
        prior_error_arms=_each_with_parameters(
            fitted.prior_error_arms, fit.value + shifts, friction_known
        ),
        prior_covariance=np.outer(relative, relative) * fit.prior_covariance,
        covariance_increase=np.outer(relative, relative) * fit.covariance_increase,
    )


def _with_hardly_known(estimate: Estimate, before: Array) -> Estimate:
    """The estimate with reasons for figures hardly better known than by the prior's covariance
    `before` (p, p)."""
    unknown = np.diag(estimate.covariance) > DETERMINED.max_sd_ratio**2 * np.diag(before)
    reasons = tuple(HARDLY_KNOWN if each else "" for each in unknown.tolist())
    return with_reasons(replace(estimate, reasons=reasons), range(len(reasons)))


def _parameter_changes(
    fit: PowerFit, arm: FittedArm, rows: Rows, others: Sequence[FittedArm]
) -> Array:
    """Changes (k, p) of the power parameters due to the torques of other arms.

    An error of the torques changes the power parameters by one step of the fit.
    """
    parameters = PowerParameters.unpacked(fit.value)
    power = replace(arm, power_parameters=parameters).power(rows)[0]
    return np.array(
        [
            fit.gain @ (power - replace(other, power_parameters=parameters).power(rows)[0])
            for other in others
        ]
    ).reshape(-1, len(fit.value))


def _covariance_scale(nq: int, value: Array) -> Array:
    """Factors (p,) from errors of packed figures to errors relative to the arm that contains the
    fitted factors."""
    scale = np.ones(packed_size(nq))
    factors = [*range(1 + 2 * nq, 1 + 5 * nq), -1]
    scale[factors] /= np.maximum(value[factors], FIT.min_factor)
    return scale


def _each_with_parameters(
    arms: Sequence[FittedArm], values: Array, friction_known: bool
) -> tuple[FittedArm, ...]:
    return tuple(
        _with_parameters(arm, each, friction_known) for arm, each in zip(arms, values, strict=True)
    )


def _with_parameters(arm: FittedArm, values: Array, friction_known: bool) -> FittedArm:
    """The arm with packed figures, whose factors and increments change its own figures."""
    found = PowerParameters.unpacked(values)
    nominal = PowerParameters.nominal(found.idle, found.copper, found.inverter)
    if friction_known:
        return replace(arm, power_parameters=nominal)
    return replace(
        arm,
        coulomb=found.dry_factor * arm.coulomb,
        curved=found.dry_factor * arm.curved,
        viscous=found.viscous_factor * arm.viscous,
        rotor_inertia=found.rotor_factor * arm.rotor_inertia,
        load=arm.load + found.load_increment,
        offset=arm.offset + found.offset_increment,
        link_scale=arm.link_scale * found.link_scale,
        power_parameters=nominal,
    )


def _figures_of_power(
    robot: Robot, prior: PowerPrior, friction_known: bool, links_known: bool
) -> tuple[Array, Array, tuple[Name, ...]]:
    """Matrix (f, p) and constants (f,) from packed figures (p,) to named figures, and the names."""
    nq, own, every = robot.nq, own_arm(robot), np.eye(packed_size(robot.nq))
    names: list[Name] = [("idle_power", None)]
    names += [(figure, joint) for figure in ("copper", "inverter_linear") for joint in range(nq)]
    matrix = [*every[: len(names)]]
    constant = [0.0] * len(names)
    if not friction_known:
        for figure, part in (("coulomb", 2), ("curved", 2), ("viscous", 3), ("rotor_inertia", 4)):
            for joint in np.flatnonzero(getattr(own, figure)).tolist():
                names.append((figure, joint))
                matrix.append(getattr(own, figure)[joint] * every[1 + part * nq + joint])
                constant.append(0.0)
        for joint in np.flatnonzero(own.load + prior.mean[1 + 5 * nq : 1 + 6 * nq]).tolist():
            names.append(("load", joint))
            matrix.append(every[1 + 5 * nq + joint])
            constant.append(float(own.load[joint]))
    if not links_known:
        names.append((LINK_MASS_SCALE, None))
        matrix.append(every[-1])
        constant.append(0.0)
    return np.array(matrix), np.array(constant), tuple(names)
