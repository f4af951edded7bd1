"""Inertials of the links, friction and rotors of all joints together, for consistent bodies.

The torques determine only combinations of the links' parameters, so a prior holds these to the
robot's own (`distance_metric`). Rows are weighted by the inverse of the effective variance of their
joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters
from joulepath.optimizer.identify.arm.friction_columns import OF_COUPLINGS, SENSOR_GAIN
from joulepath.optimizer.identify.arm.pseudo_inertia import distance_metric
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import GroupedEquations
from joulepath.optimizer.identify.fits.block import JointBlock, LawEquations, TorqueData
from joulepath.optimizer.identify.fits.consistent import solve_consistent
from joulepath.optimizer.identify.fits.curve_speed import with_curve_speeds
from joulepath.optimizer.identify.fits.determined import (
    unbounded,
    with_reasons,
)
from joulepath.optimizer.identify.fits.torque_fit import (
    doubts_of,
    held_deviations,
    remarks_on,
    undetermined,
)
from joulepath.optimizer.identify.fits.whole_arm import WholeArmRegression, whole_arm_regression
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters, effective_weights

LINK_NAMES = {f"inertials.{part}": k for k, part in enumerate(LINKS)}
"""Names of the parameters of a link, with their places in `LINKS`."""


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
    gain_sd: float = 0.03
    """Prior standard deviation of the gain of a torque sensor [1]: strain gauges are calibrated to
    some per cent of their reading."""
    relative_sd: float = 1.0
    """Prior standard deviation of a term over the robot's own value [1]."""
    default_sd: float = 10.0
    """Prior standard deviation of a term that the robot has no value of [SI unit]."""
    bound_sds: float = 1e-3
    """Standard deviations from a bound, within which a value is at the bound [1]."""


WHOLE_FIT = WholeFitSettings()


def fit_whole(data: TorqueData) -> Estimate:
    """Fit friction, rotors and couplings, and the 10 nq parameters of the links."""
    return with_curve_speeds(lambda speeds: _fit(data, speeds), data)


def _fit(data: TorqueData, speeds: Array | None) -> Estimate:
    """The fit of `fit_whole`, for given speeds (nq,) of the curved terms."""
    robot, rows, options = data.robot, data.rows, data.options
    own, bodies = body_parameters(robot.model), rows.regressor
    assert bodies is not None
    change, held = np.zeros_like(own), dict[Name, str]()
    for _ in range(WHOLE_FIT.load_passes):
        now = replace(data, rows=replace(rows, rigid=rows.rigid + bodies @ change))
        arm = whole_arm_regression(now, bodies, change, speeds)
        held |= undetermined(robot, arm.block)
        equations = _weighted(data, arm, held)
        # the columns are large, and the next pass needs the memory
        block = replace(arm.block, columns=np.zeros((0, len(arm.block.names))))
        del arm, now
        solution = _determined(robot, block, equations, options, held)
        change = solution.value[: len(own)] - own
    return _estimate(robot, solution, block.names, held)


@dataclass(frozen=True, eq=False)
class _Solution:
    """Links first, then the other terms, p in all."""

    value: Array
    replicates: Array
    """Values (G, p) without one cluster each."""
    prior_covariance: Array
    """Covariance (p, p) by the prior."""
    remarks: dict[Name, str]


def _estimate(
    robot: Robot, solution: _Solution, terms: tuple[Name, ...], held: dict[Name, str]
) -> Estimate:
    """The estimate of friction, rotors and couplings, then of the links."""
    count, bodies = len(solution.value), len(solution.value) - len(terms)
    order = np.r_[bodies:count, :bodies]
    names = (*terms, *((name, joint) for joint in range(robot.nq) for name in LINK_NAMES))
    found = Estimate(
        names=names,
        value=solution.value[order],
        replicates=solution.replicates[:, order],
        reasons=tuple(held.get(name, "") for name in names),
        prior_covariance=solution.prior_covariance[np.ix_(order, order)],
        remarks=tuple(solution.remarks.get(name, "") for name in names),
    )
    return with_reasons(found, range(len(terms), count))


def _determined(
    robot: Robot,
    block: JointBlock,
    equations: LawEquations,
    options: IdentificationOptions,
    held: dict[Name, str],
) -> _Solution:
    """The solution with undetermined terms held at the robot's own values.

    The least determined term of every joint is held until all other terms are determined. A term is
    not held if the logs reject its own value, or determine it better than the own value is known.

    Args:
        robot: the robot with its own figures.
        block: names and bounds of the terms beside the links.
        equations: weighted normal equations.
        options: weight of the prior.
        held: reasons of the held terms; the function adds further terms.
    """
    bodies = PARAMETERS_PER_BODY * robot.nq
    lower, (mean, precision) = _lower(block, bodies), _prior(robot, block, options)
    while True:
        grouped = equations.keeping(block.keeps(held))
        gram, moment = grouped.total(precision, mean)
        free = _free(block, bodies, held)
        value = _solution_of(gram, moment, mean, free, robot.nq, lower)
        inverse = _inverse(gram, free)
        # an interior-point method ends beside a bound, not at it
        inside = free & (value - lower > WHOLE_FIT.bound_sds * np.sqrt(np.diag(inverse)))
        value = np.where(inside | ~free, value, lower)
        gradient = np.where(inside, 0.0, gram @ value - moment)
        solution = unbounded(grouped, value, inside, free & ~inside, gradient, precision)
        doubts = doubts_of(block, value[bodies:], solution.sd[bodies:], held)
        remarks = remarks_on(block, doubts, solution.value[bodies:], solution.sd[bodies:])
        open_terms = [name for name in doubts if doubts[name].reason and not remarks[name]]
        if not open_terms:
            break
        for joint in {joint for _, joint in open_terms}:
            worst = max(
                (name for name in open_terms if name[1] == joint),
                key=lambda name: doubts[name].size,
            )
            held[worst] = doubts[worst].reason
    moved = inverse @ gram[:, ~free] * held_deviations(block, block.names, held)[~free[bodies:]]
    # squares are positive in spite of the rounding errors of a log without noise
    root = np.hstack([inverse @ np.linalg.cholesky(precision), moved])
    by_prior = root @ root.T
    return _Solution(value, solution.replicates, by_prior, remarks)


def _inverse(gram: Array, free: Mask) -> Array:
    """Inverse (p, p) of the equations of the `free` unknowns; 0 for all other unknowns.

    The equations are scaled first, because the unknowns have different units.
    """
    inverse, unit = np.zeros_like(gram), 1 / np.sqrt(np.diag(gram)[free])
    scale, of_free = np.outer(unit, unit), np.ix_(free, free)
    inverse[of_free] = scale * np.linalg.inv(gram[of_free] * scale)
    return inverse


def _prior(robot: Robot, block: JointBlock, options: IdentificationOptions) -> tuple[Array, Array]:
    """Prior mean (p,) and precision (p, p) of bodies and other terms."""
    own = body_parameters(robot.model)
    mean = np.concatenate([own, [block.own[name] for name in block.names]])
    sd = np.array([_prior_sd(robot, name, block.own[name]) for name in block.names])
    precision = np.zeros((len(mean), len(mean)))
    precision[: len(own), : len(own)] = options.prior_weight * distance_metric(own)
    precision[len(own) :, len(own) :] = np.diag(sd**-2.0)
    return mean, precision


def _prior_sd(robot: Robot, name: Name, own: float) -> float:
    term, joint = name
    if term == "load":
        return WHOLE_FIT.load_sd
    if term == SENSOR_GAIN:
        return WHOLE_FIT.gain_sd
    if term == "offset" and joint is not None:
        return WHOLE_FIT.offset_sd * float(robot.limits.tau_max[joint])
    known = own > 0 and term not in OF_COUPLINGS
    return WHOLE_FIT.relative_sd * own if known else WHOLE_FIT.default_sd


def _lower(block: JointBlock, bodies: int) -> Array:
    """Lower bounds (p,): none for bodies."""
    return np.concatenate([np.full(bodies, -np.inf), block.lower])


def _free(block: JointBlock, bodies: int, held: Mapping[Name, str]) -> Mask:
    """Unknowns (p,) without held terms."""
    terms = [name not in held for name in block.names]
    return np.concatenate([np.ones(bodies, dtype=bool), np.array(terms, dtype=bool)])


def _solution_of(
    gram: Array, moment: Array, mean: Array, free: Mask, links: int, lower: Array
) -> Array:
    """Solution (p,) of the normal equations for the `free` unknowns, with the rest at `mean`."""
    value = mean.copy()
    rest = moment[free] - gram[np.ix_(free, ~free)] @ mean[~free]
    value[free] = solve_consistent(gram[np.ix_(free, free)], rest, links, lower[free])
    return value


def _weighted(data: TorqueData, arm: WholeArmRegression, held: Mapping[Name, str]) -> LawEquations:
    """Normal equations, weighted by the residuals of a solution with some terms `held`."""
    robot, clusters, block = data.robot, data.clusters, arm.block
    mean, precision = _prior(robot, block, data.options)
    bodies = arm.bodies.shape[1]
    free, lower = _free(block, bodies, held), _lower(block, bodies)
    values = arm.values - block.kept_torque(held)
    of_row = Clusters(block.cluster, clusters.count)
    weight = effective_weights(block.joint, arm.values, values - arm.torque(mean), of_row)
    columns = (arm.bodies, block.columns, block.unrequested_columns)
    for _ in range(WHOLE_FIT.weight_passes):
        equations = LawEquations(
            GroupedEquations.of(columns, arm.values, weight, block.cluster, clusters.count),
            robot.nq,
        )
        gram, moment = equations.keeping(block.keeps(held)).total(precision, mean)
        value = _solution_of(gram, moment, mean, free, robot.nq, lower)
        weight = effective_weights(
            block.joint,
            arm.values,
            values - arm.torque(value),
            of_row,
            data.options.estimator == "irls",
        )
    return equations
