"""Friction and rotor inertia of each joint from its torques, for links with known inertials.

tau = tau_rigid + rotor_inertia·a + friction + offset, joint by joint, over the rows in which the
joint moves. Coupled joints are fitted as one block. Undetermined terms are held at the robot's own
figures, and the remaining terms are fitted again.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.identify.arm.friction_columns import OF_COUPLINGS
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name, join_estimates
from joulepath.optimizer.identify.estimates.grouped import RANK, GroupedEquations, column_lengths
from joulepath.optimizer.identify.fits.block import (
    SCALE,
    JointBlock,
    TorqueData,
    joint_block,
    weighted_solution,
)
from joulepath.optimizer.identify.fits.curve_speed import coupled_joints, with_curve_speeds
from joulepath.optimizer.identify.fits.determined import (
    AT_BOUND,
    DETERMINED,
    IMPOSSIBLE,
    LAW_KEPT,
    NOT_MOVING,
    UNCERTAIN,
    impossible,
    reason_of,
    rejections,
    remarks_of,
    unbounded,
)


@dataclass(frozen=True)
class TorqueFitSettings:
    """Settings of the fit of friction and rotors to torques."""

    max_scale_sd: float = 0.03
    """Standard deviation of the factor on the torque constant, above which the constant is not
    identified: the robot's own constant is better than a poor estimate."""
    min_load_sds: float = 3.0
    """Standard deviations that a load term must exceed to be identified."""
    min_load_spread: float = 0.05
    """Standard deviation of the rigid torque over the torque limit, below which a load term is not
    identified [1]."""
    own_load_sd: float = 0.06
    """Standard deviation of the robot's own load friction [1]."""
    min_rows: int = 20
    """Rows of a term, below which its joint does not count as moving."""


TORQUE_FIT = TorqueFitSettings()
LITTLE_LOAD = "It is below {:g} standard deviations."


def fit_torques(data: TorqueData) -> Estimate:
    """Fit friction and rotor inertia of all joints."""
    robot, options = data.robot, data.options

    def fit(speeds: Array | None) -> Estimate:
        blocks = [
            joint_block(data, joints, speeds)
            for joints in coupled_joints(robot.nq, options.couplings)
        ]
        found = join_estimates([_fit_block(each, data) for each in blocks])
        constants = "torque_constant" in options.targets
        return _with_torque_constants(robot, found) if constants else found

    return with_curve_speeds(fit, data)


def _with_torque_constants(robot: Robot, found: Estimate) -> Estimate:
    """Replace factors on the rigid torque by torque constants, and rescale the other terms.

    The torques of the fit were computed with the robot's own constants.
    """
    joints = [
        joint if joint is not None and name not in OF_COUPLINGS else 0
        for name, joint in found.names
    ]
    scale_at = [found.names.index((SCALE, joint)) for joint in joints]
    constants = np.array(
        [
            float(robot.drives.torque_constant[joint]) if name == SCALE else np.nan
            for (name, _), joint in zip(found.names, joints, strict=True)
        ]
    )
    not_found = np.array([bool(why) for why in found.reasons])

    def rescaled(values: Array) -> Array:
        scale = values[..., scale_at]
        return np.asarray(np.where(np.isfinite(constants), constants / scale, values / scale))

    # a figure that the logs do not determine stays the robot's own
    value = np.where(not_found, found.value, rescaled(found.value))
    replicates = np.where(not_found, found.replicates, rescaled(found.replicates))
    kept = not_found & np.isfinite(constants)
    value, replicates = np.where(kept, constants, value), np.where(kept, constants, replicates)
    names = tuple(
        ("torque_constant", joint) if name == SCALE else (name, joint)
        for name, joint in found.names
    )
    slope = np.abs(value / np.where(found.value != 0, found.value, 1.0))
    return Estimate(
        names,
        value,
        replicates,
        found.reasons,
        found.prior_covariance * np.outer(slope, slope),
        found.remarks,
    )


def _fit_block(block: JointBlock, data: TorqueData) -> Estimate:
    """Fit a block, holding the least determined term at its own value until all are determined."""
    held, clusters = undetermined(data.robot, block), data.clusters
    while True:
        free = [k for k, name in enumerate(block.names) if name not in held]
        own = np.array([block.own[name] if name in held else 0.0 for name in block.names])
        part = replace(
            block,
            names=tuple(block.names[k] for k in free),
            columns=block.columns[:, free],
            values=block.values - block.columns @ own - block.kept_torque(held),
            lower=block.lower[free],
        )
        value, weight = weighted_solution(part, data)
        grouped = GroupedEquations.of(
            part.columns, part.values, weight, block.cluster, clusters.count
        )
        inside = value > part.lower
        gram, moment = grouped.total()
        solution = unbounded(grouped, value, inside, ~inside, gram @ value - moment)
        doubts = doubts_of(part, value, solution.sd)
        remarks = remarks_on(part, doubts, solution.value, solution.sd)
        worst = _least_determined(doubts, remarks)
        if not worst:
            break
        held |= worst
        for coulomb in [name for name in worst if name[0] == "coulomb"]:
            own_of_free = np.array([block.own[name] for name in part.names])
            rejected = rejections(solution.value, solution.sd, own_of_free)
            # a law is kept as a whole: its other terms have no meaning beside the Coulomb friction
            # of another law
            for name, distance in zip(part.names, rejected.tolist(), strict=True):
                if name[0] in ("viscous", "curved", "load") and name[1] == coulomb[1]:
                    held |= {} if distance else {name: LAW_KEPT}
    # equations of all terms, with the same weights
    grouped = GroupedEquations.of(
        block.columns, block.values, weight, block.cluster, clusters.count
    )
    full, fitted = own.copy(), np.zeros(len(own), dtype=bool)
    full[free], fitted[free] = value, inside
    all_replicates = np.tile(full, (clusters.count, 1))
    all_replicates[:, free] = solution.replicates
    return Estimate(
        names=block.names,
        value=full,
        replicates=all_replicates,
        reasons=tuple(held.get(name, "") for name in block.names),
        prior_covariance=by_held_values(
            grouped.total().gram, fitted, held_deviations(block, block.names, held)
        ),
        remarks=tuple(remarks.get(name, "") for name in block.names),
    )


def by_held_values(gram: Array, fitted: Mask, sd: Array) -> Array:
    """Covariance (p, p) of the fitted unknowns due to independent errors of the held ones.

    Args:
        gram: normal matrix (p, p).
        fitted: unknowns (p,) that are neither held nor at their bounds.
        sd: standard deviations (p,) of the errors of held unknowns; 0 for all others.
    """
    covariance, scale = np.zeros_like(gram), column_lengths(gram)[fitted]
    if fitted.any() and sd.any():
        of_fitted = gram[np.ix_(fitted, fitted)] / np.outer(scale, scale)
        of_held = gram[fitted][:, sd > 0] * sd[sd > 0] / scale[:, None]
        moved = np.linalg.lstsq(of_fitted, of_held, RANK.eigenvalue_tolerance)[0] / scale[:, None]
        covariance[np.ix_(fitted, fitted)] = moved @ moved.T
    return covariance


def held_deviations(block: JointBlock, names: Sequence[Name], held: Container[Name]) -> Array:
    """Standard deviations (p,) of the robot's own values of held terms; 0 for all other terms."""
    known = block.own_sd | {name: TORQUE_FIT.own_load_sd for name in names if name[0] == "load"}
    return np.array([known[name] if name in held else 0.0 for name in names])


def not_moving(block: JointBlock) -> dict[Name, str]:
    """Terms with hardly any rows, as their joints hardly move, with the reason."""
    moved = np.count_nonzero(block.columns, axis=0).tolist()
    return {
        name: NOT_MOVING
        for name, rows in zip(block.names, moved, strict=True)
        if rows < TORQUE_FIT.min_rows
    }


def undetermined(robot: Robot, block: JointBlock) -> dict[Name, str]:
    """Terms that the rows cannot determine, for any torques, with the reason."""
    held = not_moving(block)
    for name in block.names:
        if name[0] == "load" and name[1] is not None and name not in held:
            spread, limit = block.spread[name[1]], float(robot.limits.tau_max[name[1]])
            if spread < TORQUE_FIT.min_load_spread * limit:
                held[name] = (
                    f"The rigid torque varies by only {spread:.2g} N·m, with a limit of "
                    f"{limit:.3g} N·m."
                )
    return held


class Doubt(NamedTuple):
    """Why a term is not determined; empty if it is."""

    reason: str
    size: float
    """Standard deviation over value, over that of a determined term [1]."""


def doubts_of(
    block: JointBlock, value: Array, sd: Array, held: Container[Name] = ()
) -> dict[Name, Doubt]:
    """Doubts about the fitted terms of a block; none about held terms, and about terms that are no
    figures.
    """
    found, absurd = dict[Name, Doubt](), impossible(block.names, value)
    for k, name in enumerate(block.names):
        term, inside = name[0], value[k] > block.lower[k] and value[k] != 0
        relative = float(sd[k] / abs(value[k])) if inside else np.inf
        size = relative / (TORQUE_FIT.max_scale_sd if term == SCALE else DETERMINED.max_relative_sd)
        if name in held or term in block.nuisances:
            found[name] = Doubt("", 0.0)
        elif absurd[k]:
            found[name] = Doubt(IMPOSSIBLE.format(value[k]), np.inf)
        elif term == "load" and not value[k] >= TORQUE_FIT.min_load_sds * sd[k] > 0:
            found[name] = Doubt(LITTLE_LOAD.format(TORQUE_FIT.min_load_sds), np.inf)
        elif size <= 1:
            found[name] = Doubt("", 0.0)
        else:
            reason = reason_of(float(value[k]), float(sd[k])) if inside else AT_BOUND.format(0.0)
            found[name] = Doubt(reason or UNCERTAIN.format(relative), size)
    return found


def remarks_on(
    block: JointBlock, doubts: Mapping[Name, Doubt], value: Array, sd: Array
) -> dict[Name, str]:
    """Why doubted terms of a block are not held, or empty.

    Args:
        block: the block.
        doubts: the doubt about each of its terms.
        value: estimates (p,) of the terms, each without its bound.
        sd: standard deviations (p,) of these.
    """
    own, own_sd = (
        np.array([known[name] for name in block.names]) for known in (block.own, block.own_sd)
    )
    reasons = [doubts[name].reason for name in block.names]
    sd = np.where(impossible(block.names, value), np.inf, sd)
    found = remarks_of(reasons, value, sd, own, own_sd)
    return dict(zip(block.names, found, strict=True))


def _least_determined(doubts: Mapping[Name, Doubt], remarks: Mapping[Name, str]) -> dict[Name, str]:
    """The least determined terms without a remark why they are not held, with the reasons.

    Load friction comes first; its doubts do not depend on other terms.
    """
    open_terms = {
        name: doubt for name, doubt in doubts.items() if doubt.reason and not remarks[name]
    }
    load = {name: doubt.reason for name, doubt in open_terms.items() if name[0] == "load"}
    if load or not open_terms:
        return load
    worst = max(open_terms, key=lambda name: open_terms[name].size)
    return {worst: open_terms[worst].reason}
