"""Friction and rotor inertia of each joint from its torques, for links with known inertials.

tau = tau_rigid + rotor_inertia·a + friction + offset, joint by joint, over the rows in which the
joint moves. Coupled joints are fitted as one block. Undetermined terms are held at the robot's own
figures, and the remaining terms are fitted again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.csgraph import connected_components

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.identify.arm.friction_columns import COUPLED
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name, join_estimates
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    jackknife,
    leave_one_out,
    solve_bounded,
)
from joulepath.optimizer.identify.estimates.robust import inverse_variance_weights
from joulepath.optimizer.identify.fits.block import SCALE, JointBlock, joint_block
from joulepath.optimizer.identify.options import Coupling, IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class TorqueFitSettings:
    """Settings of the fit of friction and rotors to torques."""

    max_relative_sd: float = 0.3
    """Standard deviation of a figure over its value, above which the figure is not identified."""
    max_scale_sd: float = 0.03
    """The same for the factor on the torque constant: the robot's own constant is better than a
    poor estimate."""
    min_load_sds: float = 3.0
    """Standard deviations that a load term must exceed to be identified."""
    min_load_spread: float = 0.05
    """Standard deviation of the rigid torque over the torque limit, below which a load term is not
    identified [1]."""
    own_friction_sd: float = 0.17
    """Relative standard deviation of the robot's own Coulomb and viscous friction [1]."""
    own_rotor_sd: float = 0.1
    """Relative standard deviation of the robot's own rotor inertia [1]."""
    own_load_sd: float = 0.06
    """Standard deviation of the robot's own load friction [1]."""
    min_curve_speed: float = 0.05
    """Smallest candidate for the speed of the curved term [rad/s]."""
    max_curve_speed: float = 3.0
    """Largest candidate for the speed of the curved term [rad/s]."""
    curve_speeds: int = 12
    """Number of candidates for the speed of the curved term."""
    irls_passes: int = 8
    """Solutions of the iteratively reweighted least squares."""
    min_rows: int = 20
    """Rows of a term, below which its joint does not count as moving."""


TORQUE_FIT = TorqueFitSettings()
NOT_MOVING = "The joint hardly moves in these logs."
UNCERTAIN = "Its standard deviation is {:.0%} of its value."
LAW_KEPT = "The joint's Coulomb friction is kept, and so is the rest of its law."
AT_BOUND = "The fit puts it at its bound, 0."


def fit_torques(
    robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """Fit friction and rotor inertia of all joints.

    Args:
        robot: the robot with its own figures.
        rows: rows of the logs.
        torque: motor torques (n, nq) [N·m], NaN if not logged.
        clusters: partition of the rows for the jackknife.
        options: requested figures.
    """
    settings = TORQUE_FIT
    estimates, speeds = list[Estimate](), dict[int, float]()
    candidates = np.geomspace(
        settings.min_curve_speed, settings.max_curve_speed, settings.curve_speeds
    )
    for joints in _coupled_joints(robot.nq, options.couplings):
        block = joint_block(robot, rows, torque, clusters, options, joints)
        if "curved" in options.terms:
            # the torque is not linear in the speed of the curved term: the best candidate is taken
            block = min(
                (
                    joint_block(robot, rows, torque, clusters, options, joints, speed)
                    for speed in candidates
                ),
                key=lambda each: _squared_error(each, clusters, options),
            )
        estimate = _fit_block(robot, block, clusters, options)
        estimates.append(estimate)
        if block.speed is not None:
            kept = {name for name, why in zip(estimate.names, estimate.reasons, strict=True) if why}
            speeds |= {joint: block.speed for joint in joints if ("curved", joint) not in kept}
    estimate = join_estimates(estimates)
    if "torque_constant" in options.fit:
        estimate = _with_torque_constants(robot, estimate)
    return join_estimates([estimate, _speed_estimate(speeds, clusters.count)])


def _speed_estimate(speeds: Mapping[int, float], clusters: int) -> Estimate:
    """Speeds [rad/s] of the curved terms by joint, whose errors are part of those of the terms."""
    names: tuple[Name, ...] = tuple(("speed", joint) for joint in speeds)
    value = np.array([*speeds.values()])
    covariance = np.zeros((len(value), len(value)))
    return Estimate(names, value, np.tile(value, (clusters, 1)), ("",) * len(value), covariance)


def _with_torque_constants(robot: Robot, found: Estimate) -> Estimate:
    """Replace factors on the rigid torque by torque constants, and rescale the other terms.

    The torques of the fit were computed with the robot's own constants.
    """
    joints = [
        joint if joint is not None and not name.startswith(COUPLED) else 0
        for name, joint in found.names
    ]
    scale_at = [found.names.index((SCALE, joint)) for joint in joints]
    constants = np.array(
        [
            float(robot.drives.torque_constant[joint]) if name == SCALE else np.nan
            for (name, _), joint in zip(found.names, joints, strict=True)
        ]
    )
    not_found = np.array([bool(why) for why in found.reasons])

    def rescaled(values: Array) -> Array:
        scale = values[..., scale_at]
        return np.asarray(np.where(np.isfinite(constants), constants / scale, values / scale))

    # a figure that the logs do not determine stays the robot's own
    value = np.where(not_found, found.value, rescaled(found.value))
    replicates = np.where(not_found, found.replicates, rescaled(found.replicates))
    kept = not_found & np.isfinite(constants)
    value, replicates = np.where(kept, constants, value), np.where(kept, constants, replicates)
    names = tuple(
        ("torque_constant", joint) if name == SCALE else (name, joint)
        for name, joint in found.names
    )
    slope = np.abs(value / np.where(found.value != 0, found.value, 1.0))
    return Estimate(
        names, value, replicates, found.reasons, found.prior_covariance * np.outer(slope, slope)
    )


def _coupled_joints(nq: int, couplings: Sequence[Coupling]) -> list[list[int]]:
    """Sets of joints that couplings tie together; single joints otherwise."""
    graph = np.eye(nq)
    for coupling in couplings:
        graph[np.ix_(coupling.joints, coupling.joints)] = 1
    labels = connected_components(graph, directed=False)[1]
    return [np.flatnonzero(labels == label).tolist() for label in np.unique(labels)]


def _squared_error(block: JointBlock, clusters: Clusters, options: IdentificationOptions) -> float:
    found, _ = _weighted_solution(block, clusters, options)
    residuals = block.values - block.columns @ found
    return float(residuals @ residuals)


def _fit_block(
    robot: Robot, block: JointBlock, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """Fit a block, holding the least determined term at its own value until all are determined."""
    held = _undetermined(robot, block)
    while True:
        free = [k for k, name in enumerate(block.names) if name not in held]
        own = np.array([block.own[name] if name in held else 0.0 for name in block.names])
        part = replace(
            block,
            names=tuple(block.names[k] for k in free),
            columns=block.columns[:, free],
            values=block.values - block.columns @ own - _own_curve(robot, block, held),
            lower=block.lower[free],
        )
        value, weight = _weighted_solution(part, clusters, options)
        grouped = GroupedEquations.of(
            part.columns, part.values, weight, block.cluster, clusters.count
        )
        inside = value > part.lower
        replicates = leave_one_out(grouped, value, inside)
        worst = _least_determined(part, value, np.sqrt(np.diag(jackknife(replicates))), inside)
        if not worst:
            break
        held |= worst
        for coulomb in [name for name in worst if name[0] == "coulomb"]:
            # a law is kept as a whole: its other terms have no meaning beside the Coulomb friction
            # of another law
            others = [(term, coulomb[1]) for term in ("viscous", "curved", "load")]
            held |= dict.fromkeys((name for name in others if name in block.names), LAW_KEPT)
    # equations of all terms, with the same weights
    grouped = GroupedEquations.of(
        block.columns, block.values, weight, block.cluster, clusters.count
    )
    full = own.copy()
    full[free] = value
    all_replicates = np.tile(full, (clusters.count, 1))
    all_replicates[:, free] = replicates
    return Estimate(
        names=block.names,
        value=full,
        replicates=all_replicates,
        reasons=tuple(held.get(name, "") for name in block.names),
        prior_covariance=_prior_covariance(block, grouped, free, inside),
    )


def _prior_covariance(
    block: JointBlock, grouped: GroupedEquations, free: list[int], inside: Mask
) -> Array:
    """Covariance (p, p) of the fitted terms due to the errors of the held terms."""
    covariance = np.zeros((len(block.names), len(block.names)))
    at = [k for k, fitted in zip(free, inside.tolist(), strict=True) if fitted]
    held = [k for k in range(len(block.names)) if k not in free]
    gram = grouped.gram.sum(axis=0)
    if at and held:
        settings = TORQUE_FIT
        relative_sd = {
            "coulomb": settings.own_friction_sd,
            "viscous": settings.own_friction_sd,
            "rotor_inertia": settings.own_rotor_sd,
        }
        names = [block.names[k] for k in held]
        sd = np.array([relative_sd.get(name[0], 0.0) * (block.own[name] or 0.0) for name in names])
        sd = np.where([name[0] == "load" for name in names], settings.own_load_sd, sd)
        moved = np.linalg.lstsq(gram[np.ix_(at, at)], gram[np.ix_(at, held)] * sd, rcond=None)[0]
        covariance[np.ix_(at, at)] = moved @ moved.T
    return covariance


def _undetermined(robot: Robot, block: JointBlock) -> dict[Name, str]:
    """Terms that the rows cannot determine, for any torques, with the reason."""
    held = dict[Name, str]()
    for k, name in enumerate(block.names):
        moved = np.count_nonzero(block.columns[:, k])
        if moved < TORQUE_FIT.min_rows:
            held[name] = NOT_MOVING
        elif name[0] == "load" and name[1] is not None:
            spread, limit = block.spread[name[1]], float(robot.limits.tau_max[name[1]])
            if spread < TORQUE_FIT.min_load_spread * limit:
                held[name] = (
                    f"The rigid torque varies by {spread:.2g} N·m only, of a limit of {limit:.3g} "
                    "N·m."
                )
    return held


def _own_curve(robot: Robot, block: JointBlock, held: dict[Name, str]) -> Array:
    """Curved part (n,) [N·m] of the robot's own law, for joints whose viscous part is held and
    whose curved part is not fitted."""
    total = np.zeros_like(block.values)
    for k, (term, joint) in enumerate(block.names):
        if (
            term == "viscous"
            and (term, joint) in held
            and joint is not None
            and ("curved", joint) not in block.names
        ):
            law = robot.friction
            rise = law.curved[joint] * np.arcsinh(block.columns[:, k] / law.speed[joint])
            total += np.where(block.joint == joint, rise, 0.0)
    return total


def _weighted_solution(
    block: JointBlock, clusters: Clusters, options: IdentificationOptions
) -> tuple[Array, Array]:
    """Solution (p,) and weights (n,) of the rows."""
    weight = np.ones_like(block.values)
    passes = {
        "ols": 1,
        "wls": 2 if len(np.unique(block.joint)) > 1 else 1,
        "irls": TORQUE_FIT.irls_passes,
    }[options.estimator]
    for step in range(passes):
        grouped = GroupedEquations.of(
            block.columns, block.values, weight, block.cluster, clusters.count
        )
        found = solve_bounded(grouped.gram.sum(axis=0), grouped.moment.sum(axis=0), block.lower)
        if step < passes - 1:
            residuals = block.values - block.columns @ found
            weight = inverse_variance_weights(block.joint, residuals, options.estimator == "irls")
    return found, weight


def _least_determined(block: JointBlock, value: Array, sd: Array, inside: Mask) -> dict[Name, str]:
    """The least determined term, with the reason; empty if all are determined.

    Offsets are kept with any standard deviation.
    """
    settings = TORQUE_FIT
    load = [
        k
        for k, name in enumerate(block.names)
        if name[0] == "load" and not value[k] >= settings.min_load_sds * sd[k] > 0
    ]
    if load:
        reason = f"It is below {settings.min_load_sds:g} standard deviations."
        return {block.names[k]: reason for k in load}
    worst, largest = None, settings.max_relative_sd
    for k, name in enumerate(block.names):
        if name[0] == "offset":
            continue
        relative = float(sd[k] / abs(value[k])) if inside[k] and value[k] != 0 else np.inf
        if name[0] == SCALE:
            relative *= settings.max_relative_sd / settings.max_scale_sd
        if relative > largest:
            worst, largest = name, relative
    if worst is None:
        return {}
    return {worst: UNCERTAIN.format(largest) if np.isfinite(largest) else AT_BOUND}
