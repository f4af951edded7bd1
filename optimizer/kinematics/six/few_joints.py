"""Inverse kinematics of an arm with fewer than six joints.

At a position, the joints of such an arm allow few orientations: a palletiser turns its tool about
the vertical alone. Newton's method from many starts finds the configurations, as in `multi_start`.
The limit of sixteen branches holds, too: the arm is a six-joint arm with fixed joints.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.six.multi_start import MULTI_START, MultiStart
from joulepath.optimizer.problem.branches import BranchLabel, NumberedBranch

POSITIONING_JOINTS = 3
"""Number of joints that place a point."""


class FewJoints(MultiStart):
    """`PoseSolver` of an arm with one to five joints; a pose may be off by `REACH.beyond`.

    Without this tolerance, the arm could not hold the orientation of a rounded pose.
    """

    @classmethod
    def of(cls, chain: Chain) -> FewJoints | None:
        """Inverse kinematics of a chain; None for six joints or more."""
        return cls(chain) if chain.nq < 6 else None

    def label(self, q: Array) -> NumberedBranch:
        """Branch of a configuration (nq,) [rad]: 1, or 2 if the first three joints move the flange
        in directions of negative orientation.

        It changes only where these joints are singular.
        """
        if self._chain.nq < POSITIONING_JOINTS:
            return NumberedBranch(1)
        jacobian = self._chain.flange_and_jacobian(q[None])[1][0]
        volume = np.linalg.det(jacobian[:3, :POSITIONING_JOINTS])
        return NumberedBranch(2 if volume < -MULTI_START.solved else 1)

    def solve(self, T: Array) -> tuple[Array, list[BranchLabel]]:
        """Configurations (n, nq) [rad] in [-pi, pi] that put the flange at T (4, 4), and their
        labels, see `MultiStart.solve`.
        """
        q = self.configurations(T)
        return q, [self.label(each) for each in q]

    def _is_reached(self, residual: Array, smallest: Array) -> Mask:
        return np.asarray(residual < REACH.beyond)
