"""Friction and rotor inertia of each joint from its torques, with the inertials of the links known.

tau = tau_rigid + rotor_inertia·a + friction + offset, for each joint by itself, over rows in which
it moves. Joints that a coupling ties together are fitted as one block. What the rows do not tell is
held at the robot's own figure, and the rest is fitted again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse.csgraph import connected_components

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.identify.arm.friction_columns import COUPLED
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name, joined
from joulepath.optimizer.identify.estimates.grouped import Grouped, jackknife, left_out, solve
from joulepath.optimizer.identify.estimates.robust import weights_of
from joulepath.optimizer.identify.fits.block import SCALE, Block, block_of
from joulepath.optimizer.identify.options import Coupling, IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows

# a value whose standard deviation is a larger share of it is not found; nor a load term below so
# many of them
MOST_RELATIVE_SD, LOAD_SDS = 0.3, 3.0
MOST_SCALE_SD = 0.03
# share of the torque limit that the rigid torque's standard deviation must have for a load term
LEAST_LOAD_SPREAD = 0.05
# standard deviations of terms that are held at the robot's own figure, over their values; and of
# load friction
OWN_SD = {"coulomb": 0.17, "viscous": 0.17, "rotor_inertia": 0.1}
LOAD_SD = 0.06
# speeds [rad/s] among which the curved term's is sought
SPEEDS = np.geomspace(0.05, 3.0, 12)
PASSES = 8
# fewer rows of a joint than this are no motion
LEAST_ROWS = 20
STILL = "The joint hardly moves in these logs."
UNSURE = "Its standard deviation is {:.0%} of its value."
KEPT = "The joint's Coulomb friction is kept, and so is the rest of its law."
ZERO = "The fit puts it at its bound, 0."


def fit_torques(
    robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """Friction and rotor inertia from motor torques (n, nq) [N·m], NaN where there are none."""
    found, speeds = list[Estimate](), dict[int, float]()
    for joints in _joint_sets(robot.nq, options.couplings):
        block = block_of(robot, rows, torque, clusters, options, joints)
        if "curved" in options.terms:
            # the speed at which the concave rise bends is the one at which it fits best
            block = min(
                (
                    block_of(robot, rows, torque, clusters, options, joints, speed)
                    for speed in SPEEDS
                ),
                key=lambda each: _misfit(each, clusters, options),
            )
        found.append(_fit(robot, block, clusters, options))
        if block.speed is not None:
            kept = {name for name, why in zip(found[-1].names, found[-1].why, strict=True) if why}
            speeds |= {joint: block.speed for joint in joints if ("curved", joint) not in kept}
    estimate = joined(found)
    if "torque_constant" in options.fit:
        estimate = _unscaled(robot, estimate)
    return joined([estimate, _exactly(speeds, clusters.count)])


def _exactly(speeds: Mapping[int, float], clusters: int) -> Estimate:
    """The speeds [rad/s] of the curved terms, by joint; their errors are in those of the terms."""
    names: tuple[Name, ...] = tuple(("speed", joint) for joint in speeds)
    value = np.array([*speeds.values()])
    drift = np.zeros((len(value), len(value)))
    return Estimate(names, value, np.tile(value, (clusters, 1)), ("",) * len(value), drift)


def _unscaled(robot: Robot, found: Estimate) -> Estimate:
    """The estimate with torque constants in the place of scales: torques were those of the robot's
    own constants.
    """
    joints = [
        joint if joint is not None and not name.startswith(COUPLED) else 0
        for name, joint in found.names
    ]
    at = [found.names.index((SCALE, joint)) for joint in joints]
    own = [
        float(robot.drives.torque_constant[joint]) if name == SCALE else np.nan
        for (name, _), joint in zip(found.names, joints, strict=True)
    ]
    constants = np.array(own)

    def turned(values: Array) -> Array:
        scale = values[..., at]
        return np.asarray(np.where(np.isfinite(constants), constants / scale, values / scale))

    # what the log does not tell stays the robot's own
    value = np.where([bool(why) for why in found.why], found.value, turned(found.value))
    replicates = np.where(
        [bool(why) for why in found.why], found.replicates, turned(found.replicates)
    )
    kept = np.array([bool(why) for why in found.why]) & np.isfinite(constants)
    value, replicates = np.where(kept, constants, value), np.where(kept, constants, replicates)
    names = tuple(
        ("torque_constant", joint) if name == SCALE else (name, joint)
        for name, joint in found.names
    )
    slope = np.abs(value / np.where(found.value != 0, found.value, 1.0))
    return Estimate(names, value, replicates, found.why, found.drift * np.outer(slope, slope))


def _joint_sets(nq: int, couplings: Sequence[Coupling]) -> list[list[int]]:
    """Joints that no coupling ties together are fitted apart."""
    graph = np.eye(nq)
    for coupling in couplings:
        graph[np.ix_(coupling.joints, coupling.joints)] = 1
    labels = connected_components(graph, directed=False)[1]
    return [np.flatnonzero(labels == label).tolist() for label in np.unique(labels)]


def _misfit(block: Block, clusters: Clusters, options: IdentificationOptions) -> float:
    found, _ = _weighted(block, clusters, options)
    residuals = block.values - block.columns @ found
    return float(residuals @ residuals)


def _fit(
    robot: Robot, block: Block, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """The block's estimate. What is not told is held, the least told first, until all the rest is
    told.
    """
    held = _untold(robot, block)
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
        value, weight = _weighted(part, clusters, options)
        grouped = Grouped.of(part.columns, part.values, weight, block.cluster, clusters.count)
        loose = value > part.lower
        replicates = left_out(grouped, value, loose)
        worst = _least_told(part, value, np.sqrt(np.diag(jackknife(replicates))), loose)
        if not worst:
            break
        held |= worst
        for coulomb in [name for name in worst if name[0] == "coulomb"]:
            # a law is kept as a whole: its other terms mean nothing beside another's Coulomb
            # friction
            others = [(term, coulomb[1]) for term in ("viscous", "curved", "load")]
            held |= dict.fromkeys((name for name in others if name in block.names), KEPT)
    # of all terms, with the same weights
    grouped = Grouped.of(block.columns, block.values, weight, block.cluster, clusters.count)
    full = own.copy()
    full[free] = value
    spread = np.tile(full, (clusters.count, 1))
    spread[:, free] = replicates
    return Estimate(
        names=block.names,
        value=full,
        replicates=spread,
        why=tuple(held.get(name, "") for name in block.names),
        drift=_drift(block, grouped, free, loose),
    )


def _drift(block: Block, grouped: Grouped, free: list[int], loose: Mask) -> Array:
    """Covariance (p, p) that the errors of the held terms add to the fitted ones."""
    drift = np.zeros((len(block.names), len(block.names)))
    at = [k for k, fitted in zip(free, loose.tolist(), strict=True) if fitted]
    held = [k for k in range(len(block.names)) if k not in free]
    gram = grouped.gram.sum(axis=0)
    if at and held:
        sd = np.array(
            [OWN_SD.get(block.names[k][0], 0.0) * (block.own[block.names[k]] or 0.0) for k in held]
        )
        sd = np.where([block.names[k][0] == "load" for k in held], LOAD_SD, sd)
        moved = np.linalg.lstsq(gram[np.ix_(at, at)], gram[np.ix_(at, held)] * sd, rcond=None)[0]
        drift[np.ix_(at, at)] = moved @ moved.T
    return drift


def _untold(robot: Robot, block: Block) -> dict[Name, str]:
    """Terms that the rows cannot tell, whatever the torques are."""
    held = dict[Name, str]()
    for k, name in enumerate(block.names):
        moved = np.count_nonzero(block.columns[:, k])
        if moved < LEAST_ROWS:
            held[name] = STILL
        elif name[0] == "load" and name[1] is not None:
            spread, limit = block.spread[name[1]], float(robot.limits.tau_max[name[1]])
            if spread < LEAST_LOAD_SPREAD * limit:
                held[name] = (
                    f"The rigid torque varies by {spread:.2g} N·m only, of a limit of {limit:.3g} "
                    "N·m."
                )
    return held


def _own_curve(robot: Robot, block: Block, held: dict[Name, str]) -> Array:
    """The curved part (n,) of the robot's own law, where its viscous part is held and none is
    fitted in its place.
    """
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


def _weighted(
    block: Block, clusters: Clusters, options: IdentificationOptions
) -> tuple[Array, Array]:
    """The solution (p,), and the weights (n,) of its rows."""
    weight = np.ones_like(block.values)
    passes = {"ols": 1, "wls": 2 if len(np.unique(block.joint)) > 1 else 1, "irls": PASSES}[
        options.estimator
    ]
    for step in range(passes):
        grouped = Grouped.of(block.columns, block.values, weight, block.cluster, clusters.count)
        found = solve(grouped.gram.sum(axis=0), grouped.moment.sum(axis=0), block.lower)
        if step < passes - 1:
            weight = weights_of(
                block.joint, block.values - block.columns @ found, options.estimator == "irls"
            )
    return found, weight


def _least_told(block: Block, value: Array, sd: Array, loose: Mask) -> dict[Name, str]:
    """The term that the rows tell least, with the reason; none if all are told. An offset is kept
    as it is.
    """
    load = [
        k
        for k, name in enumerate(block.names)
        if name[0] == "load" and not value[k] >= LOAD_SDS * sd[k] > 0
    ]
    if load:
        return {block.names[k]: f"It is below {LOAD_SDS:g} standard deviations." for k in load}
    worst, most = None, MOST_RELATIVE_SD
    for k, name in enumerate(block.names):
        if name[0] == "offset":
            continue
        relative = float(sd[k] / abs(value[k])) if loose[k] and value[k] != 0 else np.inf
        if name[0] == SCALE:
            # the robot's own constant is better than a poor estimate
            relative *= MOST_RELATIVE_SD / MOST_SCALE_SD
        if relative > most:
            worst, most = name, relative
    if worst is None:
        return {}
    return {worst: UNSURE.format(most) if np.isfinite(most) else ZERO}
