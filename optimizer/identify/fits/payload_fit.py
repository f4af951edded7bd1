"""Mass and centre of mass of a payload, from a log with it and at least one without it.

The torques of the log with the payload have a term more than those of the others: that of a body at
the flange. Friction, rotors, sensors' offsets and the errors of the links are the same in all logs,
and are found with it. What is left for the payload is the difference between the logs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import BODY, rigid_torques
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.arm.friction_columns import columns
from joulepath.optimizer.identify.arm.link_errors import link_deviations
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.estimates.grouped import Grouped, jackknife, left_out, solve
from joulepath.optimizer.identify.fits.block import moving
from joulepath.optimizer.identify.fits.torque_fit import LEAST_LOAD_SPREAD, MOST_RELATIVE_SD
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.results import Parameter
from joulepath.optimizer.identify.rows.clusters import Clusters, clusters_of, shared_variance
from joulepath.optimizer.identify.rows.fit_rows import Rows
from joulepath.optimizer.problem.arm import Payload

TERMS = ("coulomb", "viscous", "load", "curved", "offset", "rotor_inertia")
NAMES: tuple[Name, ...] = tuple(
    (f"payload_{part}", None) for part in ("mass", "com_x", "com_y", "com_z")
)
# the weights of joints and the payload's share of load friction follow from the fit before
PASSES = 4
# standard deviations of a payload before any log: mass [kg], first moments [kg·m], inertia about
# the last joint [kg·m²]
MASS, MOMENT, INERTIA = 100.0, 30.0, 0.1
# a term of friction is anything up to so many times the joint's torque limit, per unit of its
# column
FRICTION = 10.0
# kg; a mass that a torque sensor or a current does not show
LEAST_MASS = 1e-3
# poses of the logs at which gravity is compared
MOST_POSES = 500
SAME = "The log with the payload does not differ from the others by a load."


@dataclass(frozen=True, eq=False)
class Carried:
    """A payload: `mass` [kg], `com` (3,) [m] in the flange frame, their covariance (4, 4), and its
    `body` (10,) in the frame of the last joint. `log` is the number of the log that carries it.
    `why` it is not told, or empty: `body` is then 0."""

    log: int
    mass: float
    com: Array
    covariance: Array
    body: Array
    why: str

    def parameters(self, stated: Payload) -> tuple[Parameter, ...]:
        """Its figures, beside those that the log states."""
        own = [stated.mass, *stated.com.tolist()]
        values, deviations = (
            [self.mass, *self.com.tolist()],
            np.sqrt(np.diag(self.covariance)).tolist(),
        )
        parts = zip(NAMES, values, deviations, own, strict=True)
        return tuple(
            Parameter(*name, value, sd, said, not self.why, self.why)
            for name, value, sd, said in parts
        )


def loaded(rows: Rows, carried: Carried) -> Rows:
    """The rows with the payload in the rigid torques of the log that carries it."""
    assert rows.regressor is not None
    rigid = rows.rigid + np.where(
        (rows.log == carried.log)[:, None], rows.regressor[:, :, -BODY:] @ carried.body, 0.0
    )
    return replace(rows, rigid=rigid, regressor=None)


def joints_without_gravity(robot: Robot, rows: Rows, logs: Sequence[Log]) -> list[int]:
    """Joints at which the weight of the links hardly varies over the logs: no torque constant
    follows from it.
    """
    every = max(1, len(rows.q) // MOST_POSES)
    parts = list[Array]()
    for number, log in enumerate(logs):
        model = robot.model.copy()
        model.gravity.linear = log.gravity
        q = rows.q[rows.log == number][::every]
        parts.append(rigid_torques(model, q, np.zeros_like(q), np.zeros_like(q)))
    spread = np.concatenate(parts).std(axis=0)
    return np.flatnonzero(spread < LEAST_LOAD_SPREAD * robot.limits.tau_max).tolist()


def payload_of(robot: Robot, rows: Rows, torque: Array, log: int, threshold: float) -> Carried:
    """The payload in rows with regressors, whose rigid torques are without it in the `log` that
    carries it.

    `torque` (n, nq) [N·m] are motor torques, `threshold` [rad/s] the speed above which a joint's
    rows count. Raises InvalidProblem if that log carries less than nothing.
    """
    clusters, prior = clusters_of(rows), np.diag(_precision(robot))
    body, variance = np.zeros(BODY), np.ones(robot.nq)
    links = BODY * robot.nq
    for _ in range(PASSES):
        grouped, parts = _equations(robot, rows, torque, clusters, log, threshold, body, variance)
        gram, moment = grouped.gram.sum(axis=0) + prior, grouped.moment.sum(axis=0)
        value = solve(gram, moment, np.full(len(prior), -np.inf))
        for joint, (at, left, right, of_row) in enumerate(parts):
            if len(right):
                error = right - left @ value[at]
                variance[joint] = shared_variance(
                    error, np.ones_like(error), Clusters(of_row, clusters.count)
                )
        body = value[links : links + BODY]
    replicates = left_out(grouped, value, np.ones(len(value), dtype=bool), prior)
    inverse = np.linalg.inv(gram)
    return _told(
        robot,
        log,
        body,
        replicates[:, links : links + BODY],
        (inverse @ prior @ inverse)[links:, links:],
    )


def _equations(
    robot: Robot,
    rows: Rows,
    torque: Array,
    clusters: Clusters,
    log: int,
    threshold: float,
    body: Array,
    variance: Array,
) -> tuple[Grouped, list[tuple[list[int], Array, Array, npt.NDArray[np.int64]]]]:
    """Normal equations over all joints, weighted by their `variance` (nq,), and of each joint the
    places of its terms, its columns, its torques and the clusters of its rows. Load friction is
    that of the payload `body` (10,)."""
    assert rows.regressor is not None
    nq, speed = robot.nq, np.maximum(robot.friction.speed, 0.05)
    count, shared = (BODY + len(TERMS)) * nq + BODY, [*range(BODY * nq + BODY)]
    gram, moment = np.zeros((clusters.count, count, count)), np.zeros((clusters.count, count))
    parts = list[tuple[list[int], Array, Array, npt.NDArray[np.int64]]]()
    for joint in range(nq):
        use = moving(rows, torque, joint, threshold, ())
        links = rows.regressor[use, joint]
        carried = np.where((rows.log[use] == log)[:, None], links[:, -BODY:], 0.0)
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
        part = Grouped.of(
            left, right, np.full(len(right), 1 / variance[joint]), of_row, clusters.count
        )
        gram[np.ix_(range(clusters.count), at, at)] += part.gram
        moment[:, at] += part.moment
        parts.append((at, left, right, of_row))
    return Grouped(gram, moment), parts


def _precision(robot: Robot) -> Array:
    """Of links' errors, payload and friction before any log."""
    deviations = [link_deviations(robot), np.array([MASS, *[MOMENT] * 3, *[INERTIA] * 6])]
    deviations += [np.full(len(TERMS), FRICTION * limit) for limit in robot.limits.tau_max.tolist()]
    return np.asarray(np.concatenate(deviations) ** -2.0)


def _told(robot: Robot, log: int, body: Array, replicates: Array, drift: Array) -> Carried:
    """The payload from its body (10,), that without each cluster (G, 10), and the covariance that
    the prior adds.
    """
    flange = robot.model.frames[robot.model.getFrameId("flange")].placement
    mass = float(body[0])
    spread = jackknife(replicates[:, :4]) + drift[:4, :4]
    sd = float(np.sqrt(spread[0, 0]))
    if mass < -max(3 * sd, LEAST_MASS):
        raise InvalidProblem(
            "logs",
            f"The last of the logs carries {-mass:.3g} kg less than the others say of theirs: name "
            "the log with the "
            "payload last, and give the `payload` of the others.",
        )
    if not max(sd, LEAST_MASS) <= MOST_RELATIVE_SD * mass:
        return Carried(log, 0.0, np.zeros(3), np.diag([sd**2, 0.0, 0.0, 0.0]), np.zeros(BODY), SAME)
    com = flange.rotation.T @ (body[1:4] / mass - flange.translation)
    slope = np.zeros((4, 4))
    slope[0, 0] = 1.0
    slope[1:, 0] = -flange.rotation.T @ body[1:4] / mass**2
    slope[1:, 1:] = flange.rotation.T / mass
    return Carried(log, mass, com, slope @ spread @ slope.T, body, "")
