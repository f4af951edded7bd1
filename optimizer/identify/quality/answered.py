"""Uncertainty of the energies of answers with identified figures.

The covariance of the identified figures comes from their document; all other figures keep their
prior ranges.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from joulepath.models.from_figures import robot_of
from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.document import with_document
from joulepath.models.uncertainty.spread import Spread
from joulepath.optimizer.dynamics.interval import arm_spread
from joulepath.optimizer.dynamics.sensitivity import energy_sensitivity
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.rows.fit_rows import Rows
from joulepath.optimizer.problem.arm import Arm

CHOSEN_ROWS = 2000
"""Largest number of rows whose energy is differentiated."""


@dataclass(frozen=True)
class AnsweredEnergies:
    """Energies of an arm with identified figures, and their uncertainty as in the answers."""

    arm: Arm
    fitted: FittedArm

    @classmethod
    def of(cls, robot: Robot, document: dict[str, Any], fitted: FittedArm) -> Self:
        """Energies of a fitted arm.

        Args:
            robot: the robot before the identification.
            document: document of the identified figures.
            fitted: the fitted arm.
        """
        figures = with_document(robot.name, robot.figures, document)
        return cls(Arm(robot=robot_of(robot.name, figures)), fitted)

    @cached_property
    def spread(self) -> Spread:
        """Errors of the figures."""
        return arm_spread(self.arm)

    def gradient(self, rows: Rows) -> Array:
        """Derivatives of the energy of the rows with respect to the figures.

        Uses evenly chosen rows if there are more than `CHOSEN_ROWS`, with their weights scaled to
        the same time.

        Returns:
            Derivatives, shape (p,) [J per unit of the figure].
        """
        every = -(-len(rows.q) // CHOSEN_ROWS)
        part = rows.take(np.arange(len(rows.q)) % every == 0)
        weight = part.weight * float(rows.weight.sum()) / float(part.weight.sum())
        torque = self.fitted.link_torque(part)
        return energy_sensitivity(
            weight, part.q, part.v, part.a, torque, self.arm, self.spread
        ).gradient

    def variance(self, rows: Rows) -> float:
        """Variance of the energy of the rows [J²]."""
        gradient, time = self.gradient(rows), float(rows.weight.sum())
        figures = np.sum([*self.spread.covariances.values()], axis=0)
        return (time * self.spread.move_sd) ** 2 + float(gradient @ figures @ gradient)
