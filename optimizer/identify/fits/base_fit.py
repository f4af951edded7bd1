"""Base parameters, friction and rotors of all joints by linear least squares.

No knowledge of the links is needed: the unknowns are the combinations of the parameters of bodies
and rotors that determine the torques (Gautier 1991), beside the terms of friction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.dynamics.link_regressor import body_parameters
from joulepath.optimizer.identify.arm.base_parameters import BaseParameters, base_parameters
from joulepath.optimizer.identify.arm.friction_columns import OF_COUPLINGS, lower_bounds
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    inverse_variance_weights,
    solve_bounded,
)
from joulepath.optimizer.identify.fits.block import (
    PASSES,
    JointBlock,
    LawEquations,
    TorqueData,
    own_value,
)
from joulepath.optimizer.identify.fits.curve_speed import with_curve_speeds
from joulepath.optimizer.identify.fits.determined import (
    DETERMINED,
    IMPOSSIBLE,
    impossible,
    reason_of,
    remarks_of,
    unbounded,
    with_reasons,
)
from joulepath.optimizer.identify.fits.own_ranges import own_deviations
from joulepath.optimizer.identify.fits.torque_fit import (
    by_held_values,
    held_deviations,
    not_moving,
)
from joulepath.optimizer.identify.fits.whole_arm import WholeArmRegression, whole_arm_regression
from joulepath.optimizer.identify.options import IdentificationOptions

ROTOR = "rotor_inertia"


class Doubts(NamedTuple):
    """Doubts about p unknowns."""

    reasons: tuple[str, ...]
    """Why an unknown is not determined, or empty."""
    remarks: tuple[str, ...]
    """Why such an unknown is not held, or empty."""
    worst: int | None
    """Number of the least determined one to be held; None if there is none."""


@dataclass(frozen=True, eq=False)
class BaseTerms:
    """Unknowns of a base fit: base parameters, single rotors, then terms of friction."""

    names: tuple[Name, ...]
    """Names (p,); a base parameter is named by its expression."""
    own: Array
    """The robot's own values (p,)."""
    own_sd: Array
    """Standard deviations (p,) of these before the logs; 0 for base parameters."""
    base: BaseParameters
    """All base parameters."""
    expressed: tuple[int, ...]
    """Numbers of the base parameters that are named by an expression, in the order of `names`."""

    @staticmethod
    def of(robot: Robot, friction: list[Name], options: IdentificationOptions) -> BaseTerms:
        """Unknowns of an arm, with given terms of friction."""
        rotors = "rotor" in options.targets
        base, own = base_parameters(robot.model, rotors), body_parameters(robot.model)
        values = base.combination @ (np.append(own, robot.drives.rotor_inertia) if rotors else own)
        single = base.single_rotors(len(own))
        expressed = tuple(k for k in range(base.count) if k not in single)
        names: list[Name] = [(base.expressions[k], None) for k in expressed]
        names += [(ROTOR, base.independent[k] - len(own)) for k in single]
        names += friction
        of_joints = [own_value(robot, name) for name in names[len(expressed) :]]
        own_values = np.append(values[list(expressed)], of_joints)
        own_sd = own_deviations(robot, names, own_values)
        return BaseTerms(tuple(names), own_values, own_sd, base, expressed)

    @property
    def of_joints(self) -> Mask:
        """Which unknowns (p,) are rotors or terms of friction, and no base parameters."""
        return np.arange(len(self.names)) >= len(self.expressed)

    def names_of(self, chosen: Mask) -> set[Name]:
        """Names of some unknowns (p,)."""
        return {self.names[k] for k in np.flatnonzero(chosen)}

    def columns(self, arm: WholeArmRegression) -> Array:
        """Columns (n, p) of the unknowns, chosen from the columns of the whole arm."""
        bodies = arm.bodies.shape[1]

        def at(main: int) -> int:
            return main if main < bodies else bodies + arm.block.names.index((ROTOR, main - bodies))

        count = len(self.expressed)
        kept = [at(self.base.independent[k]) for k in self.expressed]
        return arm.columns[
            :, [*kept, *(bodies + arm.block.names.index(name) for name in self.names[count:])]
        ]

    def doubts(self, value: Array, lifted: Array, sd: Array, judged: Mask) -> Doubts:
        """Doubts about some unknowns.

        Args:
            value: estimates (p,).
            lifted: estimates (p,), each without its own bound.
            sd: standard deviations (p,) of these.
            judged: unknowns (p,) to judge, apart from offsets and couplings, which the robot has no
                values of.
        """
        judged = judged & np.array(
            [term != "offset" and term not in OF_COUPLINGS for term, _ in self.names]
        )
        absurd = impossible(self.names, value)
        sd = np.where(absurd, np.inf, sd)
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = np.where(value != 0, sd / np.abs(value), np.inf)
        doubted = judged & (relative > DETERMINED.max_relative_sd)
        reasons = [""] * len(value)
        for k in np.flatnonzero(doubted).tolist():
            reason = reason_of(float(value[k]), float(sd[k]))
            reasons[k] = IMPOSSIBLE.format(value[k]) if absurd[k] else reason
        remarks = remarks_of(reasons, lifted, sd, self.own, self.own_sd)
        left = np.flatnonzero(doubted & (np.array(remarks) == ""))
        worst = int(left[np.argmax(relative[left])]) if len(left) else None
        return Doubts(tuple(reasons), tuple(remarks), worst)

    @property
    def lower(self) -> Array:
        """Lower bounds (p,) of the unknowns."""
        count = len(self.expressed)
        return np.append(
            np.full(count, -np.inf), lower_bounds([term for term, _ in self.names[count:]])
        )

    def body_changes(self, body_count: int) -> Array:
        """Matrix (10 nq, b) from changes of the base parameters to the smallest change of bodies
        with the same torques."""
        return np.asarray(np.linalg.pinv(self.base.combination[list(self.expressed), :body_count]))


def fit_base(data: TorqueData) -> Estimate:
    """Fit base parameters and friction by ordinary, weighted or reweighted least squares.

    Undetermined friction and rotors are held at the robot's own values, the least determined first,
    until all others are determined; with the method `essential_parameters`, undetermined base
    parameters, too. An unknown is not held if the logs reject its own value, or know it better.
    """
    return with_curve_speeds(lambda speeds: _fit(data, speeds), data)


def _fit(data: TorqueData, speeds: Array | None) -> Estimate:
    """The fit of `fit_base`, for given speeds (nq,) of the curved terms."""
    options, arm = data.options, base_regression(data, speeds)
    terms = base_terms(data.robot, arm, options)
    columns, lower, block = terms.columns(arm), terms.lower, arm.block
    weight, every = np.ones_like(arm.values), (columns, block.unrequested_columns)
    for _ in range(PASSES.of(options.estimator, PASSES.wls_of_arm)):
        equations = LawEquations(
            GroupedEquations.of(every, arm.values, weight, block.cluster, data.clusters.count),
            data.robot.nq,
        )
        grouped = equations.keeping(block.keeps(()))
        value = solve_bounded(*grouped.total(), lower)
        residuals = arm.values - block.kept_torque(()) - columns @ value
        weight = inverse_variance_weights(block.joint, residuals, options.estimator == "irls")
    return _hold_undetermined(terms, block, equations, options, not_moving(block))


def _hold_undetermined(
    terms: BaseTerms,
    block: JointBlock,
    equations: LawEquations,
    options: IdentificationOptions,
    held: Mapping[Name, str],
) -> Estimate:
    """Solve for the unknowns, and hold those that the rows do not determine.

    Args:
        terms: the unknowns.
        block: the terms of the joints.
        equations: normal equations.
        options: the method.
        held: terms that no torques determine, with the reason.
    """
    own, lower = terms.own, terms.lower
    reasons = [held.get(name, "") for name in terms.names]
    free = np.array([not reason for reason in reasons])
    judged = terms.of_joints | (options.method == "essential_parameters")
    while True:
        grouped = equations.keeping(block.keeps(terms.names_of(~free)))
        part, value = _free_equations(grouped, own, free), own.copy()
        gram, moment = part.total()
        value[free] = solve_bounded(gram, moment, lower[free])
        inside = (value > lower)[free]
        gradient = gram @ value[free] - moment
        solution = unbounded(part, value[free], inside, ~inside, gradient)
        lifted, sd, undetermined = own.copy(), np.zeros(len(own)), np.zeros(len(own), dtype=bool)
        lifted[free], sd[free] = solution.value, solution.sd
        undetermined[free] = solution.undetermined
        doubts = terms.doubts(value, lifted, sd, free & (judged | undetermined))
        if doubts.worst is None:
            break
        free[doubts.worst], reasons[doubts.worst] = False, doubts.reasons[doubts.worst]
    replicates = np.tile(value, (len(grouped.gram), 1))
    replicates[:, free] = solution.replicates
    by_prior = by_held_values(
        grouped.total().gram,
        free & (value > lower),
        held_deviations(block, terms.names, terms.names_of(~free & terms.of_joints)),
    )
    found = Estimate(terms.names, value, replicates, tuple(reasons), by_prior, doubts.remarks)
    return with_reasons(found, range(len(terms.expressed)))


def base_regression(data: TorqueData, speeds: Array | None) -> WholeArmRegression:
    """Regression of the torques on all bodies, friction and rotors."""
    bodies = data.rows.regressor
    assert bodies is not None
    return whole_arm_regression(data, bodies, np.zeros(bodies.shape[2]), speeds)


def base_terms(robot: Robot, arm: WholeArmRegression, options: IdentificationOptions) -> BaseTerms:
    """Unknowns of a base fit to the whole arm."""
    return BaseTerms.of(robot, [name for name in arm.block.names if name[0] != ROTOR], options)


def _free_equations(grouped: GroupedEquations, own: Array, free: Mask) -> GroupedEquations:
    """Normal equations of the `free` unknowns (p,), with all others at the robot's `own` values."""
    held = grouped.gram[:, :, ~free] @ own[~free]
    return GroupedEquations(grouped.gram[:, free][:, :, free], (grouped.moment - held)[:, free])
