"""Inertials of the links, friction and rotors of all joints together, with links that are real
bodies.

The links' parameters are held to the robot's own by a prior (`nearness`), since the torques tell
only combinations of them. The rows are weighted by the inverse variance of their joint, and by how
many independent ones they are worth.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import BODY, body_parameters
from joulepath.optimizer.identify.arm.friction_columns import COUPLED
from joulepath.optimizer.identify.arm.pseudo_inertia import nearness
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import Grouped, jackknife, left_out
from joulepath.optimizer.identify.estimates.robust import bisquare_weights
from joulepath.optimizer.identify.fits.consistent import solve_consistent
from joulepath.optimizer.identify.fits.torque_fit import LEAST_LOAD_SPREAD, LOAD_SDS
from joulepath.optimizer.identify.fits.whole_arm import WholeArm, whole_arm
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters, shared_variance
from joulepath.optimizer.identify.rows.fit_rows import Rows

# of the load friction's torque, and of the weights: each begins where the one before ends
PASSES, WEIGHINGS = 2, 2
LINK = "inertials."
LINK_NAMES = frozenset(LINK + part for part in LINKS)
# standard deviations of the prior of terms that the robot has no figure of: load friction [1],
# offset over the torque limit, and any other term [SI]; of one that it has, over its value
LOAD_SD, OFFSET_SD, OTHER_SD, RELATIVE_SD = 0.1, 0.05, 10.0, 1.0
NOT_LOADED = "It is below {:g} standard deviations, or the rigid torque hardly varies."


def fit_whole(
    robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """Friction, rotors and couplings, then the links' 10 nq parameters, from motor torques (n, nq)
    [N·m].

    `rows` have the regressor."""
    own, bodies = body_parameters(robot.model), rows.regressor
    assert bodies is not None
    change, held = np.zeros_like(own), frozenset[int]()
    for _ in range(PASSES):
        # load friction is that of the rigid torque as it is known so far
        now = replace(rows, rigid=rows.rigid + bodies @ change)
        arm = whole_arm(robot, now, torque, clusters, options, bodies, change)
        mean, precision = _prior(robot, arm, options, held)
        value, grouped = _solve(arm, clusters, options, mean, precision, robot.nq)
        free = np.concatenate([np.ones(len(own), bool), value[len(own) :] > arm.block.lower])
        replicates = left_out(grouped, value, free, precision)
        change = value[: len(own)] - own
        held |= _unloaded(robot, arm, value, np.sqrt(np.diag(jackknife(replicates))), len(own))
        terms = arm.block.names
        del arm, now  # its columns are large, and those of the next pass take their place
    hessian = grouped.gram.sum(axis=0) + precision
    spread = np.linalg.solve(hessian, precision)
    order = np.r_[len(own) : len(value), : len(own)]
    links = [(LINK + part, joint) for joint in range(robot.nq) for part in LINKS]
    names = (*terms, *links)
    return Estimate(
        names=names,
        value=value[order],
        replicates=replicates[:, order],
        why=tuple(NOT_LOADED.format(LOAD_SDS) if k - len(own) in held else "" for k in order),
        drift=(spread @ np.linalg.inv(hessian))[np.ix_(order, order)],
    )


def _prior(
    robot: Robot, arm: WholeArm, options: IdentificationOptions, held: frozenset[int]
) -> tuple[Array, Array]:
    """Mean (p,) and precision (p, p) of bodies and other terms; those `held` are all but fixed."""
    own, names = body_parameters(robot.model), arm.block.names
    mean = np.concatenate([own, [arm.block.own[name] for name in names]])
    sd = np.array([_prior_sd(robot, name, arm.block.own[name]) for name in names])
    sd[list(held)] = 1e-9
    precision = np.zeros((len(mean), len(mean)))
    precision[: len(own), : len(own)] = options.prior_weight * nearness(own)
    precision[len(own) :, len(own) :] = np.diag(sd**-2.0)
    return mean, precision


def _prior_sd(robot: Robot, name: Name, own: float) -> float:
    term, joint = name
    if term == "load":
        return LOAD_SD
    if term == "offset" and joint is not None:
        return OFFSET_SD * float(robot.limits.tau_max[joint])
    return RELATIVE_SD * own if own > 0 and not term.startswith(COUPLED) else OTHER_SD


def _solve(
    arm: WholeArm,
    clusters: Clusters,
    options: IdentificationOptions,
    mean: Array,
    precision: Array,
    links: int,
) -> tuple[Array, Grouped]:
    """The solution (p,), and the weighted normal equations."""
    block = arm.block
    lower = np.concatenate([np.full(BODY * links, -np.inf), block.lower])
    value, weight = mean, _weights(arm, arm.values - arm.torque(mean), clusters, False)
    for _ in range(WEIGHINGS):
        grouped = Grouped.of(
            (arm.bodies, block.columns), arm.values, weight, block.cluster, clusters.count
        )
        gram, moment = (
            grouped.gram.sum(axis=0) + precision,
            grouped.moment.sum(axis=0) + precision @ mean,
        )
        value = solve_consistent(gram, moment, links, lower)
        weight = _weights(
            arm, arm.values - arm.torque(value), clusters, options.estimator == "irls"
        )
    return value, grouped


def _weights(arm: WholeArm, residuals: Array, clusters: Clusters, robust: bool) -> Array:
    """Of each row (n,): the inverse of its joint's variance, as large as if all rows were
    independent.
    """
    weight = np.ones_like(residuals)
    for joint in np.unique(arm.block.joint):
        rows = arm.block.joint == joint
        rest, cluster = residuals[rows], arm.block.cluster[rows]
        share = bisquare_weights(rest) if robust else np.ones_like(rest)
        weight[rows] = share / shared_variance(rest, share, Clusters(cluster, clusters.count))
    return weight


def _unloaded(robot: Robot, arm: WholeArm, value: Array, sd: Array, bodies: int) -> frozenset[int]:
    """Numbers of the load terms that the rows do not tell."""
    found = list[int]()
    for k, (term, joint) in enumerate(arm.block.names):
        if term == "load" and joint is not None:
            little = arm.block.spread[joint] < LEAST_LOAD_SPREAD * float(
                robot.limits.tau_max[joint]
            )
            if little or not value[bodies + k] >= LOAD_SDS * sd[bodies + k] > 0:
                found.append(k)
    return frozenset(found)
