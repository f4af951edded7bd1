"""Regression of all joints together: bodies first, then friction, rotors and couplings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import body_parameters
from joulepath.optimizer.identify.fits.block import JointBlock, TorqueData, joint_block, moving_rows


@dataclass(frozen=True, eq=False)
class WholeArmRegression:
    """Linear regression of the torques of all joints, with n rows."""

    bodies: Array
    """Columns (n, 10 bodies) of the links' parameters."""
    block: JointBlock
    """Columns of the p other terms."""
    values: Array
    """Motor torques (n,) without the part of the load [N·m]."""

    @property
    def columns(self) -> Array:
        """All columns (n, 10 bodies + p)."""
        return np.hstack([self.bodies, self.block.columns])

    def torque(self, value: Array) -> Array:
        """Torques (n,) [N·m] for parameters (10 bodies + p,) of links and other terms."""
        links = self.bodies.shape[1]
        return np.asarray(self.bodies @ value[:links] + self.block.columns @ value[links:])


def whole_arm_regression(
    data: TorqueData, bodies: Array, change: Array, speeds: Array | None
) -> WholeArmRegression:
    """Regression of all joints.

    Args:
        data: data of the fit.
        bodies: regressor (n, nq, 10 bodies) of the links, and of further bodies to be found.
        change: change (10 nq,) of the links' parameters already contained in `rows.rigid`.
        speeds: speeds (nq,) of the curved terms [rad/s]; None for the robot's own.
    """
    joints, options = range(data.robot.nq), data.options
    block = joint_block(data, joints, speeds)
    uses = [
        moving_rows(data.rows, data.torque, joint, options.velocity_threshold, options.couplings)
        for joint in joints
    ]
    ends = np.cumsum([int(use.sum()) for use in uses])
    columns = np.empty((int(ends[-1]), bodies.shape[2]))
    # filled in place: this is the largest array of a fit
    for joint, (use, part) in enumerate(zip(uses, np.split(columns, ends[:-1]), strict=True)):
        part[:] = bodies[use, joint]
    known = body_parameters(data.robot.model) + change
    return WholeArmRegression(columns, block, block.values + columns[:, : len(known)] @ known)
