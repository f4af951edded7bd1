"""Rows and columns of joints that are fitted together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.identify.arm.friction_columns import COUPLED, column, lower_bounds
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.options import Coupling, IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows

Numbers = npt.NDArray[np.int64]
SCALE = "scale"
"""The term by which the rigid torque is multiplied: the robot's own torque constant over the real
one.
"""


@dataclass(frozen=True, eq=False)
class Block:
    """Columns (n, p) of the terms `names`, the torques (n,) that they add up to, joint and cluster
    (n,) of each row.

    `own` are the robot's own values of the terms, `lower` (p,) their least ones. `spread` [N·m] is
    the standard deviation of each joint's rigid torque. `speed` [rad/s] is the curved term's where
    it was sought.
    """

    names: tuple[Name, ...]
    columns: Array
    values: Array
    joint: Numbers
    cluster: Numbers
    lower: Array
    own: Mapping[Name, float]
    spread: Mapping[int | None, float]
    speed: float | None


def terms_of(options: IdentificationOptions) -> list[str]:
    """The terms of each joint that are fitted."""
    friction = options.terms if "friction" in options.targets else ()
    scale = (SCALE,) if "torque_constant" in options.targets else ()
    return [*friction, *(("rotor_inertia",) if "rotor" in options.targets else ()), *scale]


def block_of(
    robot: Robot,
    rows: Rows,
    torque: Array,
    clusters: Clusters,
    options: IdentificationOptions,
    joints: Sequence[int],
    speed: float | None = None,
) -> Block:
    """The block of some joints, from motor torques (n, nq) [N·m], NaN where there are none.

    `speed` [rad/s] is that of the curved term; None: the robot's own, joint by joint.
    """
    terms, knee = terms_of(options), robot.friction.knee if options.knee is None else options.knee
    couplings = [
        (k, each) for k, each in enumerate(options.couplings) if set(each.joints) <= set(joints)
    ]
    coupled = [term for term in terms if term in ("coulomb", "viscous", "rotor_inertia")]
    names = [(term, joint) for joint in joints for term in terms]
    names += [(COUPLED + term, k) for k, _ in couplings for term in coupled]
    own_speed = robot.friction.speed if speed is None else np.full(robot.nq, speed)
    parts = list[tuple[Array, Array, int, Numbers]]()
    known, spread = _known(robot, rows, options), dict[int | None, float]()
    for at, joint in enumerate(joints):
        use = moving(rows, torque, joint, options.velocity_threshold, options.couplings)
        v, a, rigid = rows.v[use], rows.a[use], rows.rigid[use]
        spread[joint] = float(rigid[:, joint].std()) if use.any() else 0.0
        columns = np.zeros((int(use.sum()), len(names)))
        for k, term in enumerate(terms):
            columns[:, at * len(terms) + k] = column(
                term, v[:, joint], a[:, joint], rigid[:, joint], knee, float(own_speed[joint])
            )
        for c, (_, coupling) in enumerate(couplings):
            ratios = coupling.ratios
            for k, term in enumerate(coupled):
                place = len(joints) * len(terms) + c * len(coupled) + k
                columns[:, place] = ratios[joint] * column(
                    term, v @ ratios, a @ ratios, rigid[:, joint], knee
                )
        parts.append((columns, torque[use, joint] - known[use, joint], joint, clusters.of_row[use]))
    return Block(
        names=tuple(names),
        columns=np.concatenate([part[0] for part in parts]),
        values=np.concatenate([part[1] for part in parts]),
        joint=np.concatenate([np.full(len(part[1]), part[2]) for part in parts]),
        cluster=np.concatenate([part[3] for part in parts]),
        lower=lower_bounds([term for term, _ in names]),
        own={name: own_value(robot, name) for name in names},
        spread=spread,
        speed=speed,
    )


def moving(
    rows: Rows, torque: Array, joint: int, threshold: float, couplings: Sequence[Coupling]
) -> Mask:
    """The rows (n,) in which a joint moves faster than the threshold, as the motors coupled to it
    do.
    """
    use = np.isfinite(torque[:, joint]) & (np.abs(rows.v[:, joint]) > threshold)
    for coupling in couplings:
        if joint in coupling.joints:
            use &= np.abs(rows.v @ coupling.ratios) > threshold
    return use


def own_value(robot: Robot, name: Name) -> float:
    """The robot's own value of a figure; 0 for one that it has not."""
    term, joint = name
    if joint is None or term.startswith(COUPLED):
        return 0.0
    if term == SCALE:
        return 1.0
    if term == "rotor_inertia":
        return float(robot.drives.rotor_inertia[joint])
    own = getattr(robot.friction, term, None)
    return 0.0 if own is None else float(own[joint])


def _known(robot: Robot, rows: Rows, options: IdentificationOptions) -> Array:
    """Torque (n, nq) [N·m] of what is not fitted: rigid bodies, and the robot's own friction or
    rotors.
    """
    known = np.zeros_like(rows.rigid) if "torque_constant" in options.targets else rows.rigid.copy()
    if "friction" not in options.targets:
        known += robot.friction.torque(rows.v, rows.rigid)
    if "rotor" not in options.targets:
        known += robot.drives.rotor_inertia * rows.a
    return known
