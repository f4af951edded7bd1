"""Rows and columns of all joints together: bodies first, then friction, rotors and couplings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import body_parameters
from joulepath.optimizer.identify.fits.block import Block, block_of, moving
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True, eq=False)
class WholeArm:
    """Columns (n, 10 bodies) of the links, and the block (n, p) of the other terms. `values` (n,)
    are the torques that both add up to: those of motors, without what the arm carries."""

    bodies: Array
    block: Block
    values: Array

    @property
    def columns(self) -> Array:
        """All columns (n, 10 bodies + p)."""
        return np.hstack([self.bodies, self.block.columns])

    def torque(self, value: Array) -> Array:
        """Torques (n,) [N·m] of parameters (10 bodies + p,) of links and other terms."""
        links = self.bodies.shape[1]
        return np.asarray(self.bodies @ value[:links] + self.block.columns @ value[links:])


def whole_arm(
    robot: Robot,
    rows: Rows,
    torque: Array,
    clusters: Clusters,
    options: IdentificationOptions,
    bodies: Array,
    change: Array,
) -> WholeArm:
    """All joints, from motor torques (n, nq) [N·m]. `bodies` (n, nq, 10 bodies) is the regressor of
    the links, and of others that are to be found; `change` (10 nq,) of the links is in the rigid
    torques of `rows` already."""
    joints = range(robot.nq)
    block = block_of(robot, rows, torque, clusters, options, joints)
    uses = [
        moving(rows, torque, joint, options.velocity_threshold, options.couplings)
        for joint in joints
    ]
    ends = np.cumsum([int(use.sum()) for use in uses])
    columns = np.empty((int(ends[-1]), bodies.shape[2]))
    # filled in place: they are the largest array of a fit
    for joint, (use, part) in enumerate(zip(uses, np.split(columns, ends[:-1]), strict=True)):
        part[:] = bodies[use, joint]
    known = body_parameters(robot.model) + change
    return WholeArm(columns, block, block.values + columns[:, : len(known)] @ known)
