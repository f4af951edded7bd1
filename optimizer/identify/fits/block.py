"""Linear regression of blocks of joints; the joints of a block are fitted together."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from joulepath.models.robot import Array, FrictionLaw, Mask, Robot
from joulepath.optimizer.identify.arm.friction_columns import (
    COUPLED,
    LAW_TERMS,
    OF_COUPLINGS,
    SENSOR_COULOMB,
    column,
    deciding_term,
    lower_bounds,
)
from joulepath.optimizer.identify.choices import Estimator
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    IntArray,
    inverse_variance_weights,
    solve_bounded,
)
from joulepath.optimizer.identify.fits.own_ranges import own_deviations
from joulepath.optimizer.identify.options import Coupling, IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class PassSettings:
    """Numbers of solutions; the second and later ones use new weights of the rows."""

    wls_of_block: int = 2
    """With `wls`, for several joints; the rows of one joint have equal weights."""
    wls_of_arm: int = 3
    """With `wls`, for base parameters and friction of the whole arm."""
    irls: int = 8

    def of(self, estimator: Estimator, wls: int) -> int:
        """Number of solutions of an estimator, which is `wls` for weighted least squares."""
        return {"ols": 1, "wls": wls, "irls": self.irls}[estimator]


PASSES = PassSettings()
SCALE = "scale"
"""Factor on the rigid torque: the robot's own torque constant over the real one."""


@dataclass(frozen=True, eq=False)
class TorqueData:
    """Data of a fit to torques."""

    robot: Robot
    """The robot with its own figures."""
    rows: Rows
    """Rows of the logs; with regressors for a fit of links."""
    torque: Array
    """Torques (n, nq) [N·m], of the motors or behind the gears; NaN if not logged."""
    clusters: Clusters
    """Partition of the rows for the jackknife."""
    options: IdentificationOptions
    """Requested figures and estimator."""


@dataclass(frozen=True, eq=False)
class JointBlock:
    """Linear regression of the torques of some joints, with n rows and p terms."""

    names: tuple[Name, ...]
    columns: Array
    """Columns (n, p) of the terms."""
    values: Array
    """Torques (n,) without the known parts [N·m]."""
    joint: IntArray
    """Joint of a row (n,)."""
    cluster: IntArray
    """Cluster of a row (n,)."""
    lower: Array
    """Lower bounds (p,) of the terms."""
    own: Mapping[Name, float]
    """The robot's own values of the terms."""
    own_sd: dict[Name, float]
    """Prior standard deviations of the own values; 0 for terms besides friction and rotors."""
    spread: Mapping[int | None, float]
    """Standard deviation of the rigid torque of each joint [N·m]."""
    speed: Array
    """Speed scales (nq,) of the curved terms [rad/s]."""
    nuisances: frozenset[str]
    """Terms of the measurement, no figures of the robot."""
    unrequested: Array
    """Torque (n,) of the unrequested terms of the robot's own friction law [N·m]. A joint keeps
    these terms if its deciding term is held; otherwise its law has only the requested terms."""
    deciding: str | None
    """Name of the deciding term, from `deciding_term`; None if no friction is fitted."""

    def keeps(self, held: Container[Name]) -> Mask:
        """Whether joints (nq,) keep their unrequested terms, given the held terms."""
        return np.array(
            [self.deciding is None or (self.deciding, j) in held for j in range(len(self.speed))]
        )

    @property
    def unrequested_columns(self) -> Array:
        """Torques of the unrequested terms (n, nq) [N·m]; nonzero only in the rows of the joint."""
        return np.where(
            self.joint[:, None] == np.arange(len(self.speed)), self.unrequested[:, None], 0
        )

    def kept_torque(self, held: Container[Name]) -> Array:
        """Torque of the kept unrequested terms (n,) [N·m], given the held terms."""
        return np.where(self.keeps(held)[self.joint], self.unrequested, 0.0)


@dataclass(frozen=True, eq=False)
class LawEquations:
    """Normal equations of G groups for p unknowns, for any set of joints with kept terms."""

    every: GroupedEquations
    """Equations in the unknowns, followed by the torques (nq,) of unrequested terms."""
    nq: int

    def keeping(self, joints: Mask) -> GroupedEquations:
        """Equations if some joints (nq,) keep their unrequested terms."""
        gram, moment, p = self.every.gram, self.every.moment, self.every.gram.shape[1] - self.nq
        kept = gram[:, :p, p:][:, :, joints].sum(axis=2)
        return GroupedEquations(gram[:, :p, :p], moment[:, :p] - kept)


def terms_of(options: IdentificationOptions) -> list[str]:
    """Names of the terms fitted per joint."""
    friction = options.joint_terms if "friction" in options.targets else ()
    scale = (SCALE,) if "torque_constant" in options.targets else ()
    return [*friction, *(("rotor_inertia",) if "rotor" in options.targets else ()), *scale]


def joint_block(data: TorqueData, joints: Sequence[int], speed: Array | None = None) -> JointBlock:
    """Regression of some joints.

    Args:
        data: data of the fit.
        joints: numbers of the joints.
        speed: speeds (nq,) of the curved terms [rad/s]; None for the robot's own.
    """
    robot, rows, torque, options = data.robot, data.rows, data.torque, data.options
    terms, knee = terms_of(options), robot.friction.knee if options.knee is None else options.knee
    couplings = [
        (k, each) for k, each in enumerate(options.couplings) if set(each.joints) <= set(joints)
    ]
    coupled = [term for term in terms if term in COUPLED]
    names = [(term, joint) for joint in joints for term in terms]
    names += [(COUPLED[term], k) for k, _ in couplings for term in coupled]
    speed = robot.friction.speed if speed is None else speed
    own = np.array([own_value(robot, name) for name in names])
    parts = list[tuple[Array, Array, int, IntArray, Array]]()
    known, spread = _known_torque(robot, rows, options), dict[int | None, float]()
    for at, joint in enumerate(joints):
        use = moving_rows(rows, torque, joint, options.velocity_threshold, options.couplings)
        v, a, rigid = rows.v[use], rows.a[use], rows.rigid[use]
        spread[joint] = float(rigid[:, joint].std()) if use.any() else 0.0
        columns = np.zeros((int(use.sum()), len(names)))
        first = at * len(terms)
        columns[:, first : first + len(terms)] = _own_columns(
            rows, use, joint, terms, knee, float(speed[joint]), options.reversal
        )
        columns[:, len(joints) * len(terms) :] = _coupled_columns(
            v, a, rigid, joint, coupled, [each for _, each in couplings], knee
        )
        rest = _unrequested_law(robot, terms, knee).torque(v, rigid)[:, joint]
        parts.append(
            (columns, (torque - known)[use, joint], joint, data.clusters.of_row[use], rest)
        )
    return JointBlock(
        names=tuple(names),
        columns=np.concatenate([part[0] for part in parts]),
        values=np.concatenate([part[1] for part in parts]),
        joint=np.concatenate([np.full(len(part[1]), part[2]) for part in parts]),
        cluster=np.concatenate([part[3] for part in parts]),
        lower=lower_bounds([term for term, _ in names]),
        own=dict(zip(names, own.tolist(), strict=True)),
        own_sd=dict(zip(names, own_deviations(robot, names, own).tolist(), strict=True)),
        spread=spread,
        speed=speed,
        nuisances=options.nuisances,
        unrequested=np.concatenate([part[4] for part in parts]),
        deciding=deciding_term(terms),
    )


def _own_columns(
    rows: Rows,
    use: Mask,
    joint: int,
    terms: Sequence[str],
    knee: float,
    speed: float,
    reversal: int,
) -> Array:
    """Columns (n, k) of the terms of a joint in some rows."""
    v, a, rigid = rows.v[use, joint], rows.a[use, joint], rows.rigid[use, joint]
    columns = np.zeros((len(v), len(terms)))
    for k, term in enumerate(terms):
        columns[:, k] = (
            column(term, v, a, rigid, knee, speed)
            if term != SENSOR_COULOMB or rows.drags is None
            else rows.drags[use, joint, reversal]
        )
    return columns


def _coupled_columns(
    v: Array,
    a: Array,
    rigid: Array,
    joint: int,
    terms: Sequence[str],
    couplings: Sequence[Coupling],
    knee: float,
) -> Array:
    """Columns (n, p) of the terms of every coupling in the rows of a joint, with v, a and rigid
    torques (n, nq)."""
    found = [
        each.ratios[joint] * column(term, v @ each.ratios, a @ each.ratios, rigid[:, joint], knee)
        for each in couplings
        for term in terms
    ]
    return np.stack(found, axis=1) if found else np.zeros((len(v), 0))


def _unrequested_law(robot: Robot, terms: Sequence[str], knee: float) -> FrictionLaw:
    """The robot's own friction law without the terms of a fit."""
    law, none = robot.friction, np.zeros(robot.nq)
    parts: dict[str, Any] = {name: none for name in LAW_TERMS if name in terms}
    return replace(law, **parts, knee=knee)


def moving_rows(
    rows: Rows, torque: Array, joint: int, threshold: float, couplings: Sequence[Coupling]
) -> Mask:
    """Select the rows with a torque and with motion of a joint and its coupled motors.

    Args:
        rows: rows of the logs.
        torque: motor torques (n, nq) [N·m], NaN if not logged.
        joint: number of the joint.
        threshold: smallest speed of a moving joint or motor [rad/s].
        couplings: motors shared by several joints.
    """
    use = np.isfinite(torque[:, joint]) & (np.abs(rows.v[:, joint]) > threshold)
    for coupling in couplings:
        if joint in coupling.joints:
            use &= np.abs(rows.v @ coupling.ratios) > threshold
    return use


def weighted_solution(block: JointBlock, data: TorqueData) -> tuple[Array, Array]:
    """Solution (p,) and weights (n,) of the rows."""
    options = data.options
    weight = np.ones_like(block.values)
    one_joint = len(np.unique(block.joint)) <= 1
    passes = PASSES.of(options.estimator, 1 if one_joint else PASSES.wls_of_block)
    for step in range(passes):
        grouped = GroupedEquations.of(
            block.columns, block.values, weight, block.cluster, data.clusters.count
        )
        found = solve_bounded(*grouped.total(), block.lower)
        if step < passes - 1:
            residuals = block.values - block.columns @ found
            weight = inverse_variance_weights(block.joint, residuals, options.estimator == "irls")
    return found, weight


def own_value(robot: Robot, name: Name) -> float:
    """The robot's own value of a term; 0 for a term without one."""
    term, joint = name
    if joint is None or term in OF_COUPLINGS:
        return 0.0
    if term == SCALE:
        return 1.0
    of_drive = getattr(robot.drives, term, None)
    own = getattr(robot.friction, term, None) if of_drive is None else of_drive
    return 0.0 if own is None else float(own[joint])


def _known_torque(robot: Robot, rows: Rows, options: IdentificationOptions) -> Array:
    """Torque of the rigid bodies and of rotors without a fit, shape (n, nq) [N·m]."""
    known = np.zeros_like(rows.rigid) if "torque_constant" in options.targets else rows.rigid.copy()
    if "rotor" not in options.targets:
        known += robot.drives.rotor_inertia * rows.a
    return known
