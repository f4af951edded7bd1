"""Inertials of the links, friction and rotors of all joints together, for consistent bodies.

The torques determine only combinations of the links' parameters, so a prior holds these to the
robot's own (`distance_metric`). Rows are weighted by the inverse of the effective variance of their
joint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters
from joulepath.optimizer.identify.arm.friction_columns import COUPLED
from joulepath.optimizer.identify.arm.pseudo_inertia import distance_metric
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    jackknife,
    leave_one_out,
)
from joulepath.optimizer.identify.estimates.robust import bisquare_weights
from joulepath.optimizer.identify.fits.consistent import solve_consistent
from joulepath.optimizer.identify.fits.torque_fit import TORQUE_FIT
from joulepath.optimizer.identify.fits.whole_arm import WholeArmRegression, whole_arm_regression
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters, effective_variance
from joulepath.optimizer.identify.rows.fit_rows import Rows

LINK = "inertials."
LINK_NAMES = frozenset(LINK + part for part in LINKS)
NOT_LOADED = "It is below {:g} standard deviations, or the rigid torque hardly varies."


@dataclass(frozen=True)
class WholeFitSettings:
    """Settings of the fit of links and friction together."""

    load_passes: int = 2
    """Fits; load friction follows the rigid torque of the previous fit."""
    weight_passes: int = 2
    """Solutions per fit; the weights follow the residuals of the previous solution."""
    load_sd: float = 0.1
    """Prior standard deviation of load friction [1]."""
    offset_sd: float = 0.05
    """Prior standard deviation of an offset over the torque limit [1]."""
    relative_sd: float = 1.0
    """Prior standard deviation of a term over the robot's own value [1]."""
    default_sd: float = 10.0
    """Prior standard deviation of a term that the robot has no value of [SI unit]."""
    held_sd: float = 1e-9
    """Prior standard deviation of a term that is held [SI unit]."""


WHOLE_FIT = WholeFitSettings()


def fit_whole(
    robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """Fit friction, rotors and couplings, and the 10 nq parameters of the links.

    Args:
        robot: the robot with its own figures.
        rows: rows with regressors.
        torque: motor torques (n, nq) [N·m], NaN if not logged.
        clusters: partition of the rows for the jackknife.
        options: requested figures and weight of the prior.
    """
    own, bodies = body_parameters(robot.model), rows.regressor
    assert bodies is not None
    change, held = np.zeros_like(own), frozenset[int]()
    for _ in range(WHOLE_FIT.load_passes):
        now = replace(rows, rigid=rows.rigid + bodies @ change)
        arm = whole_arm_regression(robot, now, torque, clusters, options, bodies, change)
        mean, precision = _prior(robot, arm, options, held)
        value, grouped = _solve(arm, clusters, options, mean, precision, robot.nq)
        free = np.concatenate([np.ones(len(own), bool), value[len(own) :] > arm.block.lower])
        replicates = leave_one_out(grouped, value, free, precision)
        change = value[: len(own)] - own
        held |= _unloaded(robot, arm, value, np.sqrt(np.diag(jackknife(replicates))), len(own))
        terms = arm.block.names
        del arm, now  # the columns are large, and those of the next pass need the memory
    hessian = grouped.gram.sum(axis=0) + precision
    spread = np.linalg.solve(hessian, precision)
    order = np.r_[len(own) : len(value), : len(own)]
    links = [(LINK + part, joint) for joint in range(robot.nq) for part in LINKS]
    names = (*terms, *links)
    return Estimate(
        names=names,
        value=value[order],
        replicates=replicates[:, order],
        reasons=tuple(
            NOT_LOADED.format(TORQUE_FIT.min_load_sds) if k - len(own) in held else ""
            for k in order
        ),
        prior_covariance=(spread @ np.linalg.inv(hessian))[np.ix_(order, order)],
    )


def _prior(
    robot: Robot, arm: WholeArmRegression, options: IdentificationOptions, held: frozenset[int]
) -> tuple[Array, Array]:
    """Prior mean (p,) and precision (p, p) of bodies and other terms, of which some are `held`."""
    own, names = body_parameters(robot.model), arm.block.names
    mean = np.concatenate([own, [arm.block.own[name] for name in names]])
    sd = np.array([_prior_sd(robot, name, arm.block.own[name]) for name in names])
    sd[list(held)] = WHOLE_FIT.held_sd
    precision = np.zeros((len(mean), len(mean)))
    precision[: len(own), : len(own)] = options.prior_weight * distance_metric(own)
    precision[len(own) :, len(own) :] = np.diag(sd**-2.0)
    return mean, precision


def _prior_sd(robot: Robot, name: Name, own: float) -> float:
    term, joint = name
    if term == "load":
        return WHOLE_FIT.load_sd
    if term == "offset" and joint is not None:
        return WHOLE_FIT.offset_sd * float(robot.limits.tau_max[joint])
    known = own > 0 and not term.startswith(COUPLED)
    return WHOLE_FIT.relative_sd * own if known else WHOLE_FIT.default_sd


def _solve(
    arm: WholeArmRegression,
    clusters: Clusters,
    options: IdentificationOptions,
    mean: Array,
    precision: Array,
    links: int,
) -> tuple[Array, GroupedEquations]:
    """Solution (p,) under the prior, and the weighted normal equations."""
    block = arm.block
    lower = np.concatenate([np.full(PARAMETERS_PER_BODY * links, -np.inf), block.lower])
    value, weight = mean, _weights(arm, arm.values - arm.torque(mean), clusters, False)
    for _ in range(WHOLE_FIT.weight_passes):
        grouped = GroupedEquations.of(
            (arm.bodies, block.columns), arm.values, weight, block.cluster, clusters.count
        )
        gram = grouped.gram.sum(axis=0) + precision
        moment = grouped.moment.sum(axis=0) + precision @ mean
        value = solve_consistent(gram, moment, links, lower)
        weight = _weights(
            arm, arm.values - arm.torque(value), clusters, options.estimator == "irls"
        )
    return value, grouped


def _weights(arm: WholeArmRegression, residuals: Array, clusters: Clusters, robust: bool) -> Array:
    """Weights (n,) of rows by the inverse of the effective variance of their joint."""
    weight = np.ones_like(residuals)
    for joint in np.unique(arm.block.joint):
        rows = arm.block.joint == joint
        rest, cluster = residuals[rows], arm.block.cluster[rows]
        share = bisquare_weights(rest) if robust else np.ones_like(rest)
        weight[rows] = share / effective_variance(rest, share, Clusters(cluster, clusters.count))
    return weight


def _unloaded(
    robot: Robot, arm: WholeArmRegression, value: Array, sd: Array, bodies: int
) -> frozenset[int]:
    """Numbers of the load terms that the rows do not determine."""
    settings, found = TORQUE_FIT, list[int]()
    for k, (term, joint) in enumerate(arm.block.names):
        if term == "load" and joint is not None:
            limit = float(robot.limits.tau_max[joint])
            little = arm.block.spread[joint] < settings.min_load_spread * limit
            if little or not value[bodies + k] >= settings.min_load_sds * sd[bodies + k] > 0:
                found.append(k)
    return frozenset(found)
