"""Links from the force and torque beneath the arm (Christoforou et al.), without friction.

A sensor under the base measures the wrench of all moving links on the ground. The wrench is linear
in the same parameters of the bodies as the torques, and friction and motors within the arm do not
act on it. Rotors are neglected. The reading of the sensor at rest and the weight of the base are
constant, so the mean of the wrench is subtracted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Robot
from joulepath.optimizer.dynamics.link_regressor import body_parameters
from joulepath.optimizer.identify.arm.pseudo_inertia import distance_metric
from joulepath.optimizer.identify.estimates.estimate import Estimate
from joulepath.optimizer.identify.estimates.grouped import GroupedEquations, leave_one_out
from joulepath.optimizer.identify.fits.consistent import solve_consistent
from joulepath.optimizer.identify.fits.determined import with_reasons
from joulepath.optimizer.identify.fits.whole_fit import LINK_NAMES
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters, effective_weights
from joulepath.optimizer.identify.rows.fit_rows import Rows

WRENCH_AXES = 6


@dataclass(frozen=True)
class WrenchFitSettings:
    """Settings of the fit of links to the wrench beneath the base."""

    weight_passes: int = 2
    """Solutions; the weights follow the residuals of the previous solution."""


WRENCH_FIT = WrenchFitSettings()


def fit_wrench(
    robot: Robot, rows: Rows, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """Fit the 10 nq parameters of the links as consistent bodies.

    The robot's own parameters are the prior, as in a refit from torques (`fit_whole`).

    Args:
        robot: the robot with its own figures.
        rows: rows with a wrench and its regressor.
        clusters: partition of the rows for the jackknife.
        options: the weight of the prior.
    """
    assert rows.wrench_regressor is not None
    own = body_parameters(robot.model)
    regressor = rows.wrench_regressor - rows.wrench_regressor.mean(axis=0)
    columns = regressor.reshape(-1, len(own))
    values = (rows.wrench - rows.wrench.mean(axis=0)).ravel()
    axis = np.tile(np.arange(WRENCH_AXES), len(rows.q))
    of_axes = Clusters(np.repeat(clusters.of_row, WRENCH_AXES), clusters.count)
    precision = options.prior_weight * distance_metric(own)
    value = own
    for _ in range(WRENCH_FIT.weight_passes):
        weight = effective_weights(axis, values, values - columns @ value, of_axes)
        grouped = GroupedEquations.of(columns, values, weight, of_axes.of_row, clusters.count)
        gram, moment = grouped.total(precision, own)
        value = solve_consistent(gram, moment, robot.nq, np.full(len(own), -np.inf))
    root = np.linalg.solve(gram, np.linalg.cholesky(precision))
    found = Estimate(
        names=tuple((name, joint) for joint in range(robot.nq) for name in LINK_NAMES),
        value=value,
        replicates=leave_one_out(
            grouped, value, np.ones(len(own), dtype=bool), precision
        ).estimates,
        reasons=("",) * len(own),
        prior_covariance=root @ root.T,
    )
    return with_reasons(found, range(len(own)))
