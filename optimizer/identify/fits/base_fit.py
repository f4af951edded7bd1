"""Base parameters, friction and rotors of all joints by linear least squares, without any knowledge
of the links.

The torques depend on combinations of the parameters of bodies and rotors (Gautier 1991). Here these
combinations are the unknowns, beside the terms of friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.dynamics.link_regressor import BODY, body_parameters
from joulepath.optimizer.identify.arm.base_parameters import BaseParameters, base_parameters
from joulepath.optimizer.identify.arm.friction_columns import lower_bounds
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import Grouped, jackknife, left_out, solve
from joulepath.optimizer.identify.estimates.robust import weights_of
from joulepath.optimizer.identify.fits.block import own_value
from joulepath.optimizer.identify.fits.torque_fit import MOST_RELATIVE_SD, UNSURE, ZERO
from joulepath.optimizer.identify.fits.whole_arm import WholeArm, whole_arm
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows

PASSES = {"ols": 1, "wls": 3, "irls": 8}
ROTOR = "rotor_inertia"


@dataclass(frozen=True, eq=False)
class BaseTerms:
    """The unknowns `names` (p,) of a base fit: base parameters by their expressions, lone rotors,
    terms of friction.

    `own` (p,) are the robot's own values. `base` are all base parameters, and `expressed` numbers
    those that have an expression as their name, in the order of `names`.
    """

    names: tuple[Name, ...]
    own: Array
    base: BaseParameters
    expressed: tuple[int, ...]

    @staticmethod
    def of(robot: Robot, friction: list[Name], options: IdentificationOptions) -> BaseTerms:
        """The unknowns of an arm, with those of its `friction`."""
        rotors = "rotor" in options.targets
        base, own = base_parameters(robot.model, rotors), body_parameters(robot.model)
        values = base.combination @ (np.append(own, robot.drives.rotor_inertia) if rotors else own)
        alone = base.lone(len(own))
        expressed = tuple(k for k in range(base.count) if k not in alone)
        names: list[Name] = [(base.expressions[k], None) for k in expressed]
        names += [(ROTOR, base.independent[k] - len(own)) for k in alone]
        own_values = [
            *values[list(expressed)],
            *values[list(alone)],
            *(own_value(robot, name) for name in friction),
        ]
        return BaseTerms((*names, *friction), np.array(own_values), base, expressed)

    def columns(self, arm: WholeArm) -> Array:
        """The columns (n, p) of the unknowns, from those of the whole arm."""
        bodies = arm.bodies.shape[1]

        def at(main: int) -> int:
            return main if main < bodies else bodies + arm.block.names.index((ROTOR, main - bodies))

        count = len(self.expressed)
        kept = [at(self.base.independent[k]) for k in self.expressed]
        return arm.columns[
            :, [*kept, *(bodies + arm.block.names.index(name) for name in self.names[count:])]
        ]

    @property
    def lower(self) -> Array:
        """Least values (p,)."""
        count = len(self.expressed)
        return np.append(
            np.full(count, -np.inf), lower_bounds([term for term, _ in self.names[count:]])
        )

    def bodies(self, bodies: int) -> Array:
        """The matrix (10 nq, b) that turns changes of the base parameters into the least change of
        bodies that has the same torques."""
        return np.asarray(np.linalg.pinv(self.base.combination[list(self.expressed), :bodies]))


def fit_base(
    robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions
) -> Estimate:
    """Base parameters and friction from motor torques (n, nq) [N·m], by ordinary, weighted or
    reweighted least squares.

    `rows` have the regressor. With the method `essential_parameters`, what the rows do not tell is
    held at the robot's own value, the least told first, until all the rest is told.
    """
    arm = base_arm(robot, rows, torque, clusters, options)
    terms = terms_of_arm(robot, arm, options)
    columns, lower, own, block = terms.columns(arm), terms.lower, terms.own, arm.block
    weight = np.ones_like(arm.values)
    for _ in range(PASSES[options.estimator]):
        grouped = Grouped.of(columns, arm.values, weight, block.cluster, clusters.count)
        value = solve(grouped.gram.sum(axis=0), grouped.moment.sum(axis=0), lower)
        weight = weights_of(block.joint, arm.values - columns @ value, options.estimator == "irls")
    free, why = np.ones(len(own), dtype=bool), [""] * len(own)
    while True:
        part, value = _part(grouped, own, free), own.copy()
        value[free] = solve(part.gram.sum(axis=0), part.moment.sum(axis=0), lower[free])
        replicates = np.tile(value, (clusters.count, 1))
        replicates[:, free] = left_out(part, value[free], (value > lower)[free])
        if options.method != "essential_parameters":
            break
        relative = _relative_sd(terms.names, value, replicates, free)
        worst = int(np.argmax(relative))
        if relative[worst] <= MOST_RELATIVE_SD:
            break
        free[worst] = False
        why[worst] = UNSURE.format(relative[worst]) if np.isfinite(relative[worst]) else ZERO
    return Estimate(terms.names, value, replicates, tuple(why), np.zeros((len(own), len(own))))


def base_arm(
    robot: Robot, rows: Rows, torque: Array, clusters: Clusters, options: IdentificationOptions
) -> WholeArm:
    """Rows and columns of motor torques (n, nq) [N·m], from rows with the regressor."""
    assert rows.regressor is not None
    return whole_arm(
        robot, rows, torque, clusters, options, rows.regressor, np.zeros(BODY * robot.nq)
    )


def terms_of_arm(robot: Robot, arm: WholeArm, options: IdentificationOptions) -> BaseTerms:
    """The unknowns of the whole arm."""
    return BaseTerms.of(robot, [name for name in arm.block.names if name[0] != ROTOR], options)


def _part(grouped: Grouped, own: Array, free: Mask) -> Grouped:
    """The normal equations of the unknowns that are `free` (p,), the others at the robot's `own`
    values (p,)."""
    held = grouped.gram[:, :, ~free] @ own[~free]
    return Grouped(grouped.gram[:, free][:, :, free], (grouped.moment - held)[:, free])


def _relative_sd(names: tuple[Name, ...], value: Array, replicates: Array, free: Mask) -> Array:
    """Standard deviations (p,) over values; 0 of what is held, and of offsets, which are kept as
    they are."""
    sd = np.sqrt(np.diag(jackknife(replicates)))
    counts = free & np.array([term != "offset" for term, _ in names])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(counts, np.where(value != 0, sd / np.abs(value), np.inf), 0.0)
