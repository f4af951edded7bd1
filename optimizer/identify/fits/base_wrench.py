"""Links from the force and torque beneath the arm (Christoforou et al.): without friction, without
currents.

A sensor under the base measures what all moving links exert on the ground. That wrench is linear in
the same parameters of the bodies as the torques, and friction and motors within the arm do not act
on it. Rotors are neglected. What the sensor shows at rest, and the weight of the base, are in the
mean of the wrench, which is taken out.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import BODY, body_parameters
from joulepath.optimizer.identify.arm.pseudo_inertia import nearness
from joulepath.optimizer.identify.estimates.estimate import Estimate
from joulepath.optimizer.identify.estimates.grouped import Grouped, left_out
from joulepath.optimizer.identify.fits.consistent import solve_consistent
from joulepath.optimizer.identify.fits.whole_fit import LINK
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters, shared_variance
from joulepath.optimizer.identify.rows.fit_rows import Rows

AXES = 6
WEIGHINGS = 2


def fit_wrench(
    robot: Robot, rows: Rows, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """The links' 10 nq parameters, those of real bodies, from rows with a wrench and its regressor.

    The robot's own parameters are the prior, as in a refit from torques (`fit_whole`).
    """
    assert rows.wrench_regressor is not None
    own = body_parameters(robot.model)
    regressor = rows.wrench_regressor - rows.wrench_regressor.mean(axis=0)
    columns = regressor.reshape(-1, len(own))
    values = (rows.wrench - rows.wrench.mean(axis=0)).ravel()
    cluster = np.repeat(clusters.of_row, AXES)
    precision = options.prior_weight * nearness(own)
    value = own
    for _ in range(WEIGHINGS):
        weight = _weights(values - columns @ value, clusters)
        grouped = Grouped.of(columns, values, weight, cluster, clusters.count)
        gram, moment = (
            grouped.gram.sum(axis=0) + precision,
            grouped.moment.sum(axis=0) + precision @ own,
        )
        value = solve_consistent(gram, moment, len(own) // BODY, np.full(len(own), -np.inf))
    spread = np.linalg.solve(gram, precision)
    return Estimate(
        names=tuple((LINK + part, joint) for joint in range(robot.nq) for part in LINKS),
        value=value,
        replicates=left_out(grouped, value, np.ones(len(own), dtype=bool), precision),
        why=("",) * len(own),
        drift=spread @ np.linalg.inv(gram),
    )


def _weights(residuals: Array, clusters: Clusters) -> Array:
    """Of each row and axis (6 n,): the inverse of the axis's variance, as large as if all rows were
    independent."""
    rest = residuals.reshape(-1, AXES)
    alike = np.ones(len(rest))
    return np.tile([1 / shared_variance(each, alike, clusters) for each in rest.T], len(rest))
