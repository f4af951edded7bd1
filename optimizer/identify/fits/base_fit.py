"""Base parameters, friction and rotors of all joints by linear least squares, without any knowledge of the links.

The columns of bodies and rotors are reduced to independent ones (`base_parameters`); those of friction stand beside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.energy.link_regressor import BODY
from joulepath.optimizer.identify.arm.base_parameters import base_parameters
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.estimates.grouped import Grouped, jackknife, left_out, solve
from joulepath.optimizer.identify.estimates.robust import weights_of
from joulepath.optimizer.identify.fits.whole_arm import WholeArm, whole_arm
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows

PASSES = {"ols": 1, "wls": 3, "irls": 8}
ROTOR = "rotor_inertia"


@dataclass(frozen=True, eq=False)
class BaseFit:
    """Values (p,) of the base parameters and of the friction terms `names`, and their covariance (p, p).

    `condition` and `rank` are those of the columns, weighted and scaled to length 1. `kept` (p,) are the numbers of
    their columns among those of the whole arm.
    """

    names: tuple[str | Name, ...]
    value: Array
    covariance: Array
    condition: float
    rank: int
    kept: tuple[int, ...]

    def torque(self, arm: WholeArm) -> Array:
        """Torques (n,) [N·m] of rows and columns of the same arm."""
        return np.asarray(arm.columns[:, self.kept] @ self.value)


def base_arm(robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions) -> WholeArm:
    """Rows and columns of motor torques (n, nq) [N·m], from rows with the regressor."""
    assert rows.regressor is not None
    return whole_arm(robot, rows, torque, clusters, options, rows.regressor, np.zeros(BODY * robot.nq))


def fit_base(robot: Robot, arm: WholeArm, clusters: Clusters, options: IdentificationOptions) -> BaseFit:
    """The base parameters by ordinary, weighted or reweighted least squares. Those of friction are not below 0."""
    base = base_parameters(robot.model, rotors="rotor" in options.fit)
    bodies = arm.bodies.shape[1]
    names, kept = list[str | Name](), list[int]()
    for main, expression in zip(base.independent, base.expressions, strict=True):
        if main < bodies:
            names.append(expression)
            kept.append(main)
        else:
            name = (ROTOR, main - bodies)
            names.append(name)
            kept.append(bodies + arm.block.names.index(name))
    for k, name in enumerate(arm.block.names):
        if name[0] != ROTOR:
            names.append(name)
            kept.append(bodies + k)
    columns, block = arm.columns[:, kept], arm.block
    lower = np.where(np.array(kept) < bodies, -np.inf, np.append(np.full(bodies, -np.inf), block.lower)[kept])
    weight = np.ones_like(arm.values)
    for _ in range(PASSES[options.estimator]):
        grouped = Grouped.of(columns, arm.values, weight, block.cluster, clusters.count)
        gram = grouped.gram.sum(axis=0)
        value = solve(gram, grouped.moment.sum(axis=0), lower)
        weight = weights_of(block.joint, arm.values - columns @ value, options.estimator == "irls")
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    eigenvalues = np.linalg.eigvalsh(gram / np.outer(scale, scale))
    told = eigenvalues > 1e-12 * eigenvalues[-1]
    return BaseFit(
        names=tuple(names),
        value=value,
        covariance=jackknife(left_out(grouped, value, value > lower)),
        condition=float(np.sqrt(eigenvalues[-1] / eigenvalues[0])) if told.all() else np.inf,
        rank=int(told.sum()),
        kept=tuple(kept),
    )
