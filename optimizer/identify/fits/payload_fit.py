"""Mass and centre of mass of a payload, from a log with it and at least one log without it.

The torques of the log with the payload have one more term, a body at the flange. Friction, rotors,
offsets of the sensors and errors of the links are the same in all logs. They are fitted together
with the payload, so the payload explains the difference between the logs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Robot, flange_placement
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, rigid_torques
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.arm.friction_columns import columns
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    IntArray,
    jackknife,
    leave_one_out,
    solve_bounded,
)
from joulepath.optimizer.identify.fits.block import moving_rows
from joulepath.optimizer.identify.fits.determined import DETERMINED
from joulepath.optimizer.identify.fits.own_ranges import link_deviations
from joulepath.optimizer.identify.fits.torque_fit import TORQUE_FIT
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.results import IdentifiedParameter
from joulepath.optimizer.identify.rows.clusters import Clusters, clusters_of, effective_variance
from joulepath.optimizer.identify.rows.fit_rows import Rows
from joulepath.optimizer.problem.arm import Payload

MOMENTS = 4
"""Mass and first moments, which come first among the parameters of a body."""
TERMS = ("coulomb", "viscous", "load", "curved", "offset", "rotor_inertia")
FIGURE_NAMES: tuple[Name, ...] = tuple(
    (f"payload_{part}", None) for part in ("mass", "com_x", "com_y", "com_z")
)
UNKNOWN_MASS = (
    "The standard deviation of the mass is {:.2g} kg: log poses in which the arm is stretched out "
    "and folded, with the payload and without it."
)
NO_CENTRE = "The mass is 0 within its standard deviation, so its centre is not determined."


@dataclass(frozen=True)
class PayloadFitSettings:
    """Settings of the fit of a payload."""

    passes: int = 4
    """Solutions; the weights of the joints and the load friction of the payload follow the
    previous solution."""
    mass_sd: float = 100.0
    """Prior standard deviation of the mass [kg]."""
    moment_sd: float = 30.0
    """Prior standard deviation of the first moments [kg·m]."""
    inertia_sd: float = 0.1
    """Prior standard deviation of the inertia about the last joint [kg·m²]."""
    friction_sd: float = 10.0
    """Prior standard deviation of a term of friction over the torque limit [SI unit per N·m]."""
    min_curve_speed: float = 0.05
    """Smallest speed of the curved friction term [rad/s]."""
    min_sd_ratio: float = 1.05
    max_sd_ratio: float = 5.0
    """Standard deviation of the mass without a joint over that with all joints, from which on and
    up to which the joint is compared with the others [1]."""
    max_sd: float = 0.05
    """Standard deviation of a mass over the rated payload, up to which a mass near 0 is known
    [1]."""
    min_mass: float = 1e-3
    """Mass below which a torque sensor or a current does not show a payload [kg]."""
    max_poses: int = 500
    """Largest number of poses at which gravity is compared."""


PAYLOAD_FIT = PayloadFitSettings()


@dataclass(frozen=True, eq=False)
class IdentifiedPayload:
    """A payload found from logs."""

    log: int
    """Number of the log with the payload."""
    mass: float
    """Mass [kg]."""
    com: Array
    """Centre of mass (3,) in the flange frame [m]."""
    covariance: Array
    """Covariance (4, 4) of mass and centre of mass."""
    body: Array
    """Parameters (10,) in the frame of the last joint; 0 if not identified, and for a mass that is
    0 within its deviation."""
    why: str
    """Reason for not identifying it, or empty."""

    def parameters(self, stated: Payload) -> tuple[IdentifiedParameter, ...]:
        """Figures of the payload, beside the values stated with the log."""
        own = [stated.mass, *stated.com.tolist()]
        values = [self.mass, *self.com.tolist()]
        deviations = np.sqrt(np.diag(self.covariance)).tolist()
        of_centre = self.why or ("" if self.body.any() else NO_CENTRE)
        reasons = [self.why, *[of_centre] * 3]
        return tuple(
            IdentifiedParameter(*name, value, sd, previous, not why, why)
            for name, value, sd, previous, why in zip(
                FIGURE_NAMES, values, deviations, own, reasons, strict=True
            )
        )


def with_payload(rows: Rows, payload: IdentifiedPayload) -> Rows:
    """Rows with the payload in the rigid-body torques of its log, and without regressors."""
    assert rows.regressor is not None
    rigid = rows.rigid + np.where(
        (rows.log == payload.log)[:, None],
        rows.regressor[:, :, -PARAMETERS_PER_BODY:] @ payload.body,
        0.0,
    )
    return replace(rows, rigid=rigid, regressor=None)


def joints_without_gravity(robot: Robot, rows: Rows, logs: Sequence[Log]) -> list[int]:
    """Joints with a nearly constant gravity torque, and thus without a torque constant."""
    every = max(1, len(rows.q) // PAYLOAD_FIT.max_poses)
    parts = list[Array]()
    for number, log in enumerate(logs):
        model = robot.model.copy()
        model.gravity.linear = log.gravity
        q = rows.q[rows.log == number][::every]
        parts.append(rigid_torques(model, q, np.zeros_like(q), np.zeros_like(q)))
    spread = np.concatenate(parts).std(axis=0)
    limit = TORQUE_FIT.min_load_spread * robot.limits.tau_max
    return np.flatnonzero(spread < limit).tolist()


def fit_payload(
    robot: Robot, rows: Rows, torque: Array, log: int, threshold: float
) -> IdentifiedPayload:
    """Fit the payload of one log.

    Args:
        robot: the robot with its own figures.
        rows: rows with regressors; the rigid-body torques exclude the payload.
        torque: motor torques (n, nq) [N·m], NaN if not logged.
        log: number of the log with the payload.
        threshold: smallest speed of a moving joint [rad/s].

    Raises:
        InvalidProblem: the payload has less mass than in the other logs.
    """
    clusters, prior = clusters_of(rows), np.diag(_prior_precision(robot))
    body, variance = np.zeros(PARAMETERS_PER_BODY), np.ones(robot.nq)
    links = PARAMETERS_PER_BODY * robot.nq
    for _ in range(PAYLOAD_FIT.passes):
        grouped, parts = _equations(robot, rows, torque, clusters, log, threshold, body, variance)
        gram, moment = grouped.total(prior)
        value = solve_bounded(gram, moment)
        for joint, (at, left, right, of_row) in enumerate(parts):
            if len(right):
                error = right - left @ value[at]
                variance[joint] = effective_variance(
                    right, error, np.ones_like(error), Clusters(of_row, clusters.count)
                )
        body = value[links : links + PARAMETERS_PER_BODY]
    replicates = leave_one_out(grouped, value, np.ones(len(value), dtype=bool), prior).estimates
    inverse = np.linalg.inv(gram)
    first = slice(links, links + MOMENTS)
    spread = jackknife(replicates[:, first]) + (inverse @ prior @ inverse)[first, first]
    return _payload_of_body(robot, log, body, _disagreement(gram, moment, parts, variance) * spread)


def _disagreement(
    gram: Array,
    moment: Array,
    parts: Sequence[tuple[list[int], Array, Array, IntArray]],
    variance: Array,
) -> float:
    """Variance ratio, at least 1, of the joints' estimates of the mass (Birge ratio).

    Errors of single joints, such as errors of torque constants or of the centres of links, make the
    joints disagree about the mass. Every joint is left out once. The squared change of the mass
    over its variance has the mean 1 if the variances of the rows are right (Birge 1932). A joint
    that contributes nearly nothing to the mass, or nearly everything, is not compared.

    Args:
        gram: normal matrix (p, p) of all joints and the prior.
        moment: right-hand side (p,).
        parts: per joint, the positions of its terms, its columns, torques and clusters.
        variance: variance (nq,) of the rows of each joint.
    """
    mass, found = PARAMETERS_PER_BODY * len(parts), np.linalg.solve(gram, moment)
    least, most = PAYLOAD_FIT.min_sd_ratio**2, PAYLOAD_FIT.max_sd_ratio**2
    of_all, ratios = float(np.linalg.inv(gram)[mass, mass]), list[float]()
    for joint, (at, left, right, _) in enumerate(parts):
        others, rest = gram.copy(), moment.copy()
        others[np.ix_(at, at)] -= left.T @ left / variance[joint]
        rest[at] -= left.T @ right / variance[joint]
        of_others = float(np.linalg.inv(others)[mass, mass])
        if least * of_all <= of_others <= most * of_all:
            change = float((np.linalg.solve(others, rest) - found)[mass])
            ratios.append(change**2 / (of_others - of_all))
    return max(1.0, float(np.mean(ratios))) if ratios else 1.0


def _equations(
    robot: Robot,
    rows: Rows,
    torque: Array,
    clusters: Clusters,
    log: int,
    threshold: float,
    body: Array,
    variance: Array,
) -> tuple[GroupedEquations, list[tuple[list[int], Array, Array, IntArray]]]:
    """Normal equations over all joints.

    Args:
        robot: the robot with its own figures.
        rows: rows with regressors.
        torque: motor torques (n, nq) [N·m], NaN if not logged.
        clusters: partition of the rows.
        log: number of the log with the payload.
        threshold: smallest speed of a moving joint [rad/s].
        body: parameters (10,) of the payload assumed for the load friction.
        variance: variance (nq,) of the rows of each joint.

    Returns:
        The equations; and per joint the positions of its terms, its columns, its torques and the
        clusters of its rows.
    """
    assert rows.regressor is not None
    nq = robot.nq
    speed = np.maximum(robot.friction.speed, PAYLOAD_FIT.min_curve_speed)
    count, shared = (
        (PARAMETERS_PER_BODY + len(TERMS)) * nq + PARAMETERS_PER_BODY,
        [*range(PARAMETERS_PER_BODY * nq + PARAMETERS_PER_BODY)],
    )
    gram, moment = np.zeros((clusters.count, count, count)), np.zeros((clusters.count, count))
    parts = list[tuple[list[int], Array, Array, IntArray]]()
    for joint in range(nq):
        use = moving_rows(rows, torque, joint, threshold, ())
        links = rows.regressor[use, joint]
        carried = np.where((rows.log[use] == log)[:, None], links[:, -PARAMETERS_PER_BODY:], 0.0)
        rigid = rows.rigid[use, joint]
        friction = columns(
            TERMS,
            rows.v[use, joint],
            rows.a[use, joint],
            rigid + carried @ body,
            robot.friction.knee,
            speed[joint],
        )
        left, right = np.hstack([links, carried, friction]), torque[use, joint] - rigid
        at = [
            *shared,
            *range(len(shared) + joint * len(TERMS), len(shared) + (joint + 1) * len(TERMS)),
        ]
        of_row = clusters.of_row[use]
        part = GroupedEquations.of(
            left, right, np.full(len(right), 1 / variance[joint]), of_row, clusters.count
        )
        gram[np.ix_(range(clusters.count), at, at)] += part.gram
        moment[:, at] += part.moment
        parts.append((at, left, right, of_row))
    return GroupedEquations(gram, moment), parts


def _prior_precision(robot: Robot) -> Array:
    """Prior precisions of link errors, payload and friction."""
    settings = PAYLOAD_FIT
    payload = [settings.mass_sd, *[settings.moment_sd] * 3, *[settings.inertia_sd] * 6]
    deviations = [link_deviations(robot), np.array(payload)]
    deviations += [
        np.full(len(TERMS), settings.friction_sd * limit) for limit in robot.limits.tau_max.tolist()
    ]
    return np.asarray(np.concatenate(deviations) ** -2.0)


def _payload_of_body(robot: Robot, log: int, body: Array, spread: Array) -> IdentifiedPayload:
    """The payload from its parameters.

    Args:
        robot: the robot.
        log: number of the log with the payload.
        body: parameters (10,) in the frame of the last joint.
        spread: covariance (4, 4) of mass and first moments.
    """
    min_mass = PAYLOAD_FIT.min_mass
    flange = flange_placement(robot.model)
    mass = float(body[0])
    sd = float(np.sqrt(spread[0, 0]))
    if mass < -max(3 * sd, min_mass):
        raise InvalidProblem(
            "logs",
            f"The arm carries {-mass:.3g} kg less in the last log than in the others: name the "
            "log with the payload last, and give the `payload` of the others.",
        )
    if not max(sd, min_mass) <= DETERMINED.max_relative_sd * mass:
        known = sd <= PAYLOAD_FIT.max_sd * robot.rated_payload
        return IdentifiedPayload(
            log=log,
            mass=max(mass, 0.0) if known else 0.0,
            com=np.zeros(3),
            covariance=np.diag([sd**2, 0.0, 0.0, 0.0]),
            body=np.zeros(PARAMETERS_PER_BODY),
            why="" if known else UNKNOWN_MASS.format(sd),
        )
    com = flange.rotation.T @ (body[1:4] / mass - flange.translation)
    slope = np.zeros((4, 4))
    slope[0, 0] = 1.0
    slope[1:, 0] = -flange.rotation.T @ body[1:4] / mass**2
    slope[1:, 1:] = flange.rotation.T / mass
    return IdentifiedPayload(log, mass, com, slope @ spread @ slope.T, body, "")
