"""The convention in which a six-joint arm is drawn: senses, zero positions and frames.

One arm can be described with any sense and zero position of each joint, and with any frames at base
and flange. A closed form is written for one convention, and `Drawing` converts
the poses and joint positions of a file to it and back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.six.stretched_wrist import StretchedWrist
from joulepath.optimizer.problem.branches import Label

ROUNDING = 1e-14
"""Difference of a pose from the identity that is due to rounding [m, 1]."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """Convention of a file, relative to that of a closed form.

    The joint positions of the closed form are senses * q + zeros, `senses` (6,) being 1 or -1 and
    `zeros` (6,) in [rad]. Its flange pose is T_form_base @ T_base_flange @ T_flange_form.
    """

    senses: Array
    zeros: Array
    T_form_base: Array
    T_flange_form: Array

    def pose(self, T: Array) -> Array:
        """Flange poses (..., 4, 4) of the closed form for those of the file."""
        return np.asarray(self.T_form_base @ T @ self.T_flange_form)

    def form(self, q: Array) -> Array:
        """Joint positions (..., 6) [rad] of the closed form for those of the file."""
        return np.asarray(self.senses * q + self.zeros)

    def file(self, q: Array) -> Array:
        """Joint positions (..., 6) [rad] of the file for those of the closed form."""
        return np.asarray(self.senses * (q - self.zeros))

    def file_within_turn(self, q: Array) -> Array:
        """Joint positions as of `file`, shifted by full turns into [-pi, pi]."""
        # Clipping changes no more than the last digit.
        return np.clip(wrapped(self.file(q)), -np.pi, np.pi)


def without_rounding(T: NDArray[np.floating[Any]]) -> Array:
    """The pose T (4, 4), or the identity exactly if it differs by rounding alone."""
    return np.eye(4) if np.abs(T - np.eye(4)).max() < ROUNDING else np.asarray(T, dtype=float)


def angles_without_rounding(q: Array) -> Array:
    """Angles q (n,) [rad] in [-pi, pi], zero exactly where they differ by rounding alone."""
    q = wrapped(q)
    return np.where(np.abs(q) < ROUNDING, 0.0, q)


@dataclass(frozen=True, eq=False)
class DrawnMotion:
    """Self-motion of a closed form, in the joint positions of a file."""

    motion: StretchedWrist
    drawing: Drawing

    @property
    def label(self) -> Label:
        """Branch of the curve."""
        return self.motion.label

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the moving joints."""
        return self.motion.free

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """Intervals of the parameter [rad]."""
        return self.motion.arcs

    def parameter(self, q: Array) -> float:
        """Parameter [rad] of the member nearest to q (6,) [rad]."""
        return self.motion.parameter(self.drawing.form(q))

    def clipped(self, parameter: float) -> float:
        """Nearest parameter [rad] on an arc."""
        return self.motion.clipped(parameter)

    def at(self, parameter: Array) -> Array:
        """Configurations (n, 6) [rad] at parameters (n,) on the arcs."""
        return self.drawing.file_within_turn(self.motion.at(parameter))

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes that cover the curve, see `SelfMotion.boxes`."""
        centre, sides = self.motion.boxes(parameter, half)
        return self.drawing.file(centre), sides
