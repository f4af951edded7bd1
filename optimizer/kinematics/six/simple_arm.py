"""Closed-form inverse kinematics of an arm with exactly parallel or meeting axes, by EAIK."""

from __future__ import annotations

from dataclasses import dataclass

import eaik.pybindings.EAIK as eaik
import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain, pose_error, twist_size
from joulepath.optimizer.kinematics.joint_axes import JointAxes

SAMPLES = 32
"""Number of configurations at which two arms are compared."""


@dataclass(frozen=True, eq=False)
class SimpleArm:
    """A six-joint arm with a decomposition known to EAIK.

    EAIK loses the solutions of an arm whose parallel axes have opposite senses. It is therefore
    called with parallel neighbours in one sense, and `senses` (6,), 1 or -1, are the factors of its
    joint positions. `R_zero` (3, 3) is the orientation of the flange at zero.
    """

    decomposition: eaik.Robot
    senses: Array
    R_zero: Array

    @classmethod
    def of(cls, axes: JointAxes) -> SimpleArm | None:
        """Solver for these axes; None if EAIK has no decomposition for them."""
        alike, senses = axes.in_one_sense()
        steps = np.diff(alike.points, axis=0)
        offsets = np.vstack([alike.points[:1], steps, alike.T_zero[:3, 3] - alike.points[-1]])
        decomposition = eaik.Robot(alike.directions.T, offsets.T, np.eye(3), [], True)
        if not decomposition.has_known_decomposition():
            return None
        return cls(decomposition, senses, axes.T_zero[:3, :3])

    def rows(self, T: Array) -> Array:
        """Configurations (n, 6) [rad] of the flange pose T (4, 4), including least-squares
        approximations; empty out of reach.
        """
        turned = np.array(T)
        turned[:3, :3] = T[:3, :3] @ self.R_zero.T
        try:
            rows = np.array(self.decomposition.calculate_IK(turned).Q)
        except RuntimeError:
            return np.zeros((0, 6))
        rows = rows.reshape(-1, 6) * self.senses
        return np.asarray(rows[np.isfinite(rows).all(axis=1)])

    def deviation(self, chain: Chain) -> float:
        """Largest difference [m, rad] of this arm's flange from that of a chain, at sample
        configurations.
        """
        q = np.random.default_rng(0).uniform(-np.pi, np.pi, (SAMPLES, 6))
        worst = 0.0
        for each, T in zip(q, chain.flange(q), strict=True):
            simple = np.array(self.decomposition.fwdkin(self.senses * each))
            simple[:3, :3] = simple[:3, :3] @ self.R_zero
            worst = max(worst, float(twist_size(pose_error(simple[None], T))[0]))
        return worst
