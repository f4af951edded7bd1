"""One fit: from rows of logs to an arm with fitted figures, and how well they are known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.robot import Array, Robot
from optimizer.identification.clusters import Clusters, clusters_of
from optimizer.identification.estimate import Estimate, Name, joined
from optimizer.identification.fit_rows import Rows
from optimizer.identification.fitted_arm import FittedArm, own_arm, with_torques
from optimizer.identification.options import Options
from optimizer.identification.power_fit import Prior, fit_power, prior_of
from optimizer.identification.power_model import Electrics, packed_size
from optimizer.identification.torque_fit import fit_torques
from optimizer.identification.whole_fit import fit_whole

# variances below it are rounding
LEAST_ERROR = 1e-12
LINK_MASS_SCALE = "link_mass_scale"
"""The figure of the factor on the masses of all links."""
# share of a figure's standard deviation before the log: beyond it, the log did not tell the figure
WORTH = 0.7
HARDLY = "The logs hardly tell it from the robot's own."


@dataclass(frozen=True, eq=False)
class Fitted:
    """The arm with the fitted figures, the estimate behind it, and the arms (G,) with each cluster left out.

    `drift` is the covariance of the packed electrics that the robot's own figures add, `mean_power` [W] that of the
    rows, NaN without power.
    """

    arm: FittedArm
    estimate: Estimate
    clusters: Clusters
    without: tuple[FittedArm, ...]
    drift: Array
    mean_power: float


def fit_rows(robot: Robot, rows: Rows, options: Options) -> Fitted:
    """Fits what the rows have: torques, power or both."""
    clusters, arm = clusters_of(rows), own_arm(robot, options.knee)
    estimates, without, tilted = list[Estimate](), [arm] * clusters.count, list[FittedArm]()
    torque, drift = motor_torque(arm, rows), np.zeros((packed_size(robot.nq),) * 2)
    with_torque, with_power = bool(np.isfinite(torque).any()), bool(np.isfinite(rows.power).any())
    if with_torque:
        found, arm, without, tilted = _fit_torque(robot, rows, torque, arm, clusters, options)
        estimates.append(found)
    if with_power:
        found, arm, without, drift = _fit_power(robot, rows, arm, without, tilted, clusters, options)
        estimates.append(found)
    mean = float(np.mean(rows.power[np.isfinite(rows.power) & ~rows.rest])) if with_power else np.nan
    return Fitted(arm, joined(estimates), clusters, tuple(without), drift, mean)


def _fit_torque(
    robot: Robot, rows: Rows, torque: Array, arm: FittedArm, clusters: Clusters, options: Options
) -> tuple[Estimate, FittedArm, list[FittedArm], list[FittedArm]]:
    """The torques' estimate, the arm with it, the arms without each cluster, and those with one error each by what was
    held at the robot's own figures."""
    couplings = tuple(options.couplings)
    if not options.refit:
        found = fit_torques(robot, rows, torque, clusters, options)
        arms = [with_torques(arm, found.names, values, couplings) for values in found.replicates]
        sizes, directions = np.linalg.eigh(found.drift)
        errors = [np.sqrt(size) * directions[:, k] for k, size in enumerate(sizes) if size > LEAST_ERROR]
        tilted = [with_torques(arm, found.names, found.value + each, couplings) for each in errors]
        return found, with_torques(arm, found.names, found.value, couplings), arms, tilted
    whole = fit_whole(robot, rows, torque, clusters, options)
    found, terms = whole.estimate, len(whole.estimate.names) - len(whole.change)
    names = found.names[:terms]
    arms = [
        replace(with_torques(arm, names, values[:terms], couplings), bodies=change)
        for values, change in zip(found.replicates, whole.changes, strict=True)
    ]
    return found, replace(with_torques(arm, names, found.value[:terms], couplings), bodies=whole.change), arms, []


def motor_torque(arm: FittedArm, rows: Rows) -> Array:
    """The logged motor torques (n, nq) [N·m], NaN where there are none."""
    return rows.effort * arm.torque_constant if rows.current else rows.effort


def _fit_power(
    robot: Robot,
    rows: Rows,
    arm: FittedArm,
    without: list[FittedArm],
    tilted: list[FittedArm],
    clusters: Clusters,
    options: Options,
) -> tuple[Estimate, FittedArm, list[FittedArm], Array]:
    """The power's estimate, the arms with it, and the covariance of the electrics that the prior adds."""
    use = np.isfinite(rows.power)
    part, of_row = rows.take(use), Clusters(clusters.of_row[use], clusters.count)
    friction_known = arm is not without[0]
    prior = prior_of(robot, friction_known)
    fit = fit_power(
        arm.motion(part), part.power, arm.torque_constant, arm.regeneration, prior, of_row, options.estimator == "irls"
    )
    replicates, drift = fit.replicates, fit.drift
    if friction_known:
        # the error of the friction moves the electrics, too: one step of the fit with each friction
        here = replace(arm, electrics=Electrics.unpacked(fit.value)).power(part)[0]
        moved = [
            fit.gain @ (here - replace(each, electrics=Electrics.unpacked(fit.value)).power(part)[0])
            for each in (*without, *tilted)
        ]
        replicates = replicates + np.array(moved[: clusters.count])
        errors = np.array(moved[clusters.count :]).reshape(-1, len(fit.value))
        drift = drift + errors.T @ errors
    arms = [_with_electrics(each, values, friction_known) for each, values in zip(without, replicates, strict=True)]
    estimate = _power_estimate(robot, prior, fit.value, replicates, drift, friction_known)
    # of factors on friction and links as they are scaled in the arm. What the held terms' errors add to the electrics
    # is not in it: the electrics make up for it in the energy
    relative, factors = np.ones(packed_size(robot.nq)), [*range(1 + 2 * robot.nq, 1 + 5 * robot.nq), -1]
    relative[factors] /= np.maximum(fit.value[factors], 1e-3)
    return estimate, _with_electrics(arm, fit.value, friction_known), arms, np.outer(relative, relative) * fit.drift


def _with_electrics(arm: FittedArm, values: Array, friction_known: bool) -> FittedArm:
    electrics = Electrics.unpacked(values)
    plain = Electrics.plain(electrics.idle, electrics.copper, electrics.inverter)
    if friction_known:
        return replace(arm, electrics=plain)
    return replace(
        arm,
        coulomb=electrics.dry * arm.coulomb,
        curved=electrics.dry * arm.curved,
        viscous=electrics.viscous * arm.viscous,
        rotor_inertia=electrics.rotor * arm.rotor_inertia,
        load=arm.load + electrics.load,
        offset=arm.offset + electrics.offset,
        links=arm.links * electrics.links,
        electrics=plain,
    )


def _power_estimate(
    robot: Robot, prior: Prior, value: Array, replicates: Array, drift: Array, friction_known: bool
) -> Estimate:
    """The packed figures as an estimate; what is fitted of the friction, if anything, as its coefficients."""
    nq, own, every = robot.nq, own_arm(robot), np.eye(packed_size(robot.nq))
    names: list[Name] = [("idle_power", None)]
    names += [(figure, joint) for figure in ("copper", "inverter_linear") for joint in range(nq)]
    turn, known = [*every[: len(names)]], [0.0] * len(names)
    if not friction_known:
        for figure, part in (("coulomb", 2), ("curved", 2), ("viscous", 3), ("rotor_inertia", 4)):
            for joint in np.flatnonzero(getattr(own, figure)).tolist():
                names.append((figure, joint))
                turn.append(getattr(own, figure)[joint] * every[1 + part * nq + joint])
                known.append(0.0)
        for joint in np.flatnonzero(own.load + prior.mean[1 + 5 * nq : 1 + 6 * nq]).tolist():
            names.append(("load", joint))
            turn.append(every[1 + 5 * nq + joint])
            known.append(float(own.load[joint]))
        names.append((LINK_MASS_SCALE, None))
        turn.append(every[-1])
        known.append(0.0)
    matrix, constant = np.array(turn), np.array(known)
    found = Estimate(
        tuple(names), matrix @ value + constant, replicates @ matrix.T + constant, (), matrix @ drift @ matrix.T
    )
    before = matrix @ np.linalg.inv(prior.precision) @ matrix.T
    untold = np.diag(found.covariance) > WORTH**2 * np.diag(before)
    return replace(found, why=tuple(HARDLY if each else "" for each in untold.tolist()))
