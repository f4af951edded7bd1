"""A pose of the TCP in the robot's base frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array
from optimizer.exceptions import InvalidProblem
from optimizer.problem.arrays import frozen


@dataclass(frozen=True)
class Pose:
    """Pose of the TCP in the robot's base frame: `T` is the homogeneous matrix T_base_tcp, shape (4, 4), metres."""

    T: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "T", frozen(self.T, (4, 4), "pose"))
        rotation = self.T[:3, :3]
        # 1e-9: a rotation assembled in double precision is orthonormal to about 1e-15
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-9 or np.linalg.det(rotation) < 0:
            raise InvalidProblem("pose", "The pose's rotation matrix must be orthonormal and right-handed.")
        if self.T[3].tolist() != [0, 0, 0, 1]:
            raise InvalidProblem("pose", "The last row of the pose's matrix must be 0, 0, 0, 1.")
