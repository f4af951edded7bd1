"""One fit: from rows of logs to an arm with fitted figures, and how well they are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import body_parameters
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm, own_arm, with_torques
from joulepath.optimizer.identify.arm.power_model import Electrics, packed_size
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name, joined
from joulepath.optimizer.identify.fits.base_fit import BaseTerms, fit_base
from joulepath.optimizer.identify.fits.base_wrench import fit_wrench
from joulepath.optimizer.identify.fits.periodic import fit_periodic
from joulepath.optimizer.identify.fits.power_fit import Prior, fit_power, prior_of
from joulepath.optimizer.identify.fits.torque_fit import fit_torques
from joulepath.optimizer.identify.fits.whole_fit import LINK, fit_whole
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import MeasuredNoise
from joulepath.optimizer.identify.rows.clusters import Clusters, clusters_of
from joulepath.optimizer.identify.rows.fit_rows import Rows

# share of the greatest variance, of parameters that are scaled to one size: below it, a common
# error is rounding
LEAST_ERROR = 1e-3
LINK_MASS_SCALE = "link_mass_scale"
"""The figure of the factor on the masses of all links."""
# share of a figure's standard deviation before the log: beyond it, the log did not tell the figure
WORTH = 0.7
HARDLY = "The logs hardly tell it from the robot's own."


@dataclass(frozen=True, eq=False)
class Fitted:
    """The arm with the fitted figures, the estimate behind it, and the arms (G,) `without` each
    cluster.

    The jackknife of the `varied` arms (G,) is the error of the fit by the errors of the rows. What
    the fit takes from the robot's own figures has errors: the `tilted` arms have one of them each,
    in the torques and in what the electrics make of it. `drift` is the covariance of the packed
    electrics by their own ranges, and `lost` (G, p, p) what leaving each cluster out adds to all of
    their covariance. `mean_power` [W] is that of the rows, NaN without power. `noise` is that of a
    periodic motion, `thresholds` (nq,) [rad/s] are speeds below which no sample of a joint was
    used; None where the method finds none.
    """

    arm: FittedArm
    estimate: Estimate
    clusters: Clusters
    without: tuple[FittedArm, ...]
    varied: tuple[FittedArm, ...]
    tilted: tuple[FittedArm, ...]
    drift: Array
    lost: Array
    mean_power: float
    noise: MeasuredNoise | None = None
    thresholds: Array | None = None


def fit_rows(robot: Robot, rows: Rows, options: IdentificationOptions) -> Fitted:
    """Fits what the rows have: torques, power or both; or the wrench beneath the base."""
    clusters, arm = clusters_of(rows), own_arm(robot, options.knee)
    torque, with_power = motor_torque(arm, rows), bool(np.isfinite(rows.power).any())
    fitted = Fitted(
        arm=arm,
        estimate=joined([]),
        clusters=clusters,
        without=(arm,) * clusters.count,
        varied=(arm,) * clusters.count,
        tilted=(),
        drift=np.zeros((packed_size(robot.nq),) * 2),
        lost=np.zeros((clusters.count, *(packed_size(robot.nq),) * 2)),
        mean_power=float(np.mean(rows.power[np.isfinite(rows.power) & ~rows.rest]))
        if with_power
        else np.nan,
    )
    if options.method == "base_wrench":
        return _with_wrench(robot, rows, fitted, options)
    errors = np.zeros((0, 0))
    if np.isfinite(torque).any():
        fitted, errors = _with_torque(robot, rows, torque, fitted, options)
    return _with_power(robot, rows, fitted, errors, options) if with_power else fitted


def _with_torque(
    robot: Robot, rows: Rows, torque: Array, fitted: Fitted, options: IdentificationOptions
) -> tuple[Fitted, Array]:
    """With the torques fitted, and the errors (k, p) of the tilted arms' parameters."""
    own = fitted.arm
    noise = None
    if options.method == "periodic":
        found, noise = fit_periodic(robot, rows, torque, fitted.clusters, options)
    else:
        fit = fit_whole if options.refit else fit_base if options.reduced else fit_torques
        found = fit(robot, rows, torque, fitted.clusters, options)
    of_links = np.array([joint is None or name.startswith(LINK) for name, joint in found.names])
    terms = tuple(
        name for name, of_link in zip(found.names, of_links.tolist(), strict=True) if not of_link
    )
    turn, before = _link_changes(robot, options)

    def arm(values: Array) -> FittedArm:
        made = with_torques(own, terms, values[~of_links], tuple(options.couplings))
        return replace(made, bodies=turn @ (values[of_links] - before)) if of_links.any() else made

    errors = _errors(found.drift)
    without = tuple(arm(values) for values in found.replicates)
    made = replace(
        fitted,
        arm=arm(found.value),
        estimate=found,
        without=without,
        varied=without,
        tilted=tuple(arm(found.value + error) for error in errors),
        noise=noise,
    )
    return made, errors


def _link_changes(robot: Robot, options: IdentificationOptions) -> tuple[Array, Array]:
    """The matrix (10 nq, k) that turns changes of the links' unknowns into those of bodies, and the
    robot's own values (k,) of these unknowns."""
    links = body_parameters(robot.model)
    if not options.reduced:
        return np.eye(len(links)), links
    terms = BaseTerms.of(robot, [], options)
    return terms.bodies(len(links)), terms.own[: len(terms.expressed)]


def _with_wrench(
    robot: Robot, rows: Rows, fitted: Fitted, options: IdentificationOptions
) -> Fitted:
    """With the links fitted to the wrench beneath the base; all else is the robot's own."""
    found, own = fit_wrench(robot, rows, fitted.clusters, options), body_parameters(robot.model)

    def arm(values: Array) -> FittedArm:
        return replace(fitted.arm, bodies=values - own)

    without = tuple(arm(values) for values in found.replicates)
    return replace(
        fitted,
        arm=arm(found.value),
        estimate=found,
        without=without,
        varied=without,
        tilted=tuple(arm(found.value + error) for error in _errors(found.drift)),
    )


def _errors(covariance: Array) -> Array:
    """Independent errors (k, p) of parameters (p,), whose squares add up to their covariance but
    for rounding.
    """
    sd = np.sqrt(np.diag(covariance))
    scale = np.where(sd > 0, sd, 1.0)
    sizes, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = sizes > LEAST_ERROR * sizes[-1]
    return np.asarray(np.sqrt(sizes[kept])[:, None] * directions[:, kept].T * sd)


def motor_torque(arm: FittedArm, rows: Rows) -> Array:
    """The logged motor torques (n, nq) [N·m], NaN where there are none."""
    return rows.effort * arm.torque_constant if rows.current else rows.effort


def _with_power(
    robot: Robot, rows: Rows, fitted: Fitted, errors: Array, options: IdentificationOptions
) -> Fitted:
    """With the power fitted, whose figures follow the `errors` (k, p) of the tilted arms."""
    use, clusters, arm = np.isfinite(rows.power), fitted.clusters, fitted.arm
    part, of_row = rows.take(use), Clusters(clusters.of_row[use], clusters.count)
    torque_known = len(fitted.estimate.names) > 0
    prior = prior_of(robot, torque_known)
    fit = fit_power(
        arm.motion(part),
        part.power,
        arm.torque_constant,
        arm.regeneration,
        prior,
        of_row,
        options.estimator == "irls",
    )
    # an error of the torques moves the electrics, too: one step of the fit with each of them
    others = fitted.without if torque_known else ()
    here = replace(arm, electrics=Electrics.unpacked(fit.value)).power(part)[0]
    moved = np.array(
        [
            fit.gain
            @ (here - replace(each, electrics=Electrics.unpacked(fit.value)).power(part)[0])
            for each in (*others, *fitted.tilted)
        ]
    ).reshape(-1, len(fit.value))
    shifts = moved[len(others) :]
    by_torques = moved[: len(others)] if torque_known else 0.0
    without, varied = fit.without + by_torques, fit.adjusted + by_torques
    turn, constant, names = _figures_of_power(robot, prior, torque_known)
    estimate = Estimate(
        names,
        turn @ fit.value + constant,
        varied @ turn.T + constant,
        (),
        turn @ (fit.drift + shifts.T @ shifts) @ turn.T,
    )
    before = turn @ np.linalg.inv(prior.precision) @ turn.T
    untold = np.diag(estimate.covariance) > WORTH**2 * np.diag(before)
    estimate = replace(estimate, why=tuple(HARDLY if each else "" for each in untold.tolist()))
    # of factors, as they are scaled in the arm
    relative, factors = (
        np.ones(packed_size(robot.nq)),
        [*range(1 + 2 * robot.nq, 1 + 5 * robot.nq), -1],
    )
    relative[factors] /= np.maximum(fit.value[factors], 1e-3)
    return replace(
        fitted,
        arm=_with_electrics(arm, fit.value, torque_known),
        estimate=joined(
            [fitted.estimate, estimate], errors.T @ shifts @ turn.T if torque_known else None
        ),
        without=_each_with_electrics(fitted.without, without, torque_known),
        varied=_each_with_electrics(fitted.varied, varied, torque_known),
        tilted=_each_with_electrics(fitted.tilted, fit.value + shifts, torque_known),
        drift=np.outer(relative, relative) * fit.drift,
        lost=np.outer(relative, relative) * fit.lost,
    )


def _each_with_electrics(
    arms: Sequence[FittedArm], values: Array, torque_known: bool
) -> tuple[FittedArm, ...]:
    return tuple(
        _with_electrics(arm, each, torque_known) for arm, each in zip(arms, values, strict=True)
    )


def _with_electrics(arm: FittedArm, values: Array, torque_known: bool) -> FittedArm:
    electrics = Electrics.unpacked(values)
    plain = Electrics.plain(electrics.idle, electrics.copper, electrics.inverter)
    if torque_known:
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


def _figures_of_power(
    robot: Robot, prior: Prior, torque_known: bool
) -> tuple[Array, Array, tuple[Name, ...]]:
    """The matrix (f, p) and the constants (f,) that make figures of packed ones (p,), and the
    figures' names.
    """
    nq, own, every = robot.nq, own_arm(robot), np.eye(packed_size(robot.nq))
    names: list[Name] = [("idle_power", None)]
    names += [(figure, joint) for figure in ("copper", "inverter_linear") for joint in range(nq)]
    turn = [*every[: len(names)]]
    constant = [0.0] * len(names)
    if not torque_known:
        for figure, part in (("coulomb", 2), ("curved", 2), ("viscous", 3), ("rotor_inertia", 4)):
            for joint in np.flatnonzero(getattr(own, figure)).tolist():
                names.append((figure, joint))
                turn.append(getattr(own, figure)[joint] * every[1 + part * nq + joint])
                constant.append(0.0)
        for joint in np.flatnonzero(own.load + prior.mean[1 + 5 * nq : 1 + 6 * nq]).tolist():
            names.append(("load", joint))
            turn.append(every[1 + 5 * nq + joint])
            constant.append(float(own.load[joint]))
        names.append((LINK_MASS_SCALE, None))
        turn.append(every[-1])
        constant.append(0.0)
    return np.array(turn), np.array(constant), tuple(names)
