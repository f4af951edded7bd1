"""Conventions of a six-joint arm: senses of rotation, zero positions and frames.

An arm can be described with any sense of rotation and zero position of its joints, and with any
frames at base and flange. A closed form of the inverse kinematics holds for one convention.
`Drawing` converts poses and joint positions between this convention and the convention of a file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped

LEAST_ENTRY = 1e-14
"""Largest difference of a pose from the identity by rounding [m, 1]."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """Convention of a file, relative to the convention of a closed form.

    The joint positions of the closed form are senses * q + zeros, `senses` (6,) being 1 or -1 and
    `zeros` (6,) in [rad]. Its flange pose is T_form_base @ T_base_flange @ T_flange_form.
    """

    senses: Array
    zeros: Array
    T_form_base: Array
    T_flange_form: Array

    def pose(self, T: Array) -> Array:
        """Flange poses (..., 4, 4) of the closed form from flange poses of the file."""
        return np.asarray(self.T_form_base @ T @ self.T_flange_form)

    def form(self, q: Array) -> Array:
        """Joint positions (..., 6) [rad] of the closed form from joint positions of the file."""
        return np.asarray(self.senses * q + self.zeros)

    def file(self, q: Array) -> Array:
        """Joint positions (..., 6) [rad] of the file from joint positions of the closed form."""
        return np.asarray(self.senses * (q - self.zeros))

    def file_within_turn(self, q: Array) -> Array:
        """Joint positions as of `file`, shifted by full turns into [-pi, pi]."""
        # Clipping changes no more than the last digit.
        return np.clip(wrapped(self.file(q)), -np.pi, np.pi)


def without_rounding(T: NDArray[np.floating[Any]]) -> Array:
    """The pose T (4, 4), or the identity exactly if it differs by rounding alone."""
    return np.eye(4) if np.abs(T - np.eye(4)).max() < LEAST_ENTRY else np.asarray(T, dtype=float)


def angles_without_rounding(q: Array) -> Array:
    """Angles q (n,) [rad] in [-pi, pi]; angles within rounding of zero become exactly zero."""
    q = wrapped(q)
    return np.where(np.abs(q) < LEAST_ENTRY, 0.0, q)
