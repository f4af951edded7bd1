"""Information of a motion about parameters: criterion, condition number and predicted
deviations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.excitation.excitation_problem import Criterion


@dataclass(frozen=True)
class InformationSettings:
    """Settings of the criteria."""

    min_eigenvalue: float = 1e-12
    """Eigenvalue of the scaled information that counts as zero [1]."""
    smooth_power: int = 4
    """Power of the inverse eigenvalues whose mean is the smooth condition number."""


INFORMATION = InformationSettings()


@dataclass(frozen=True)
class Information:
    """Regression columns (m, p) of a motion, each row divided by the noise of its torque."""

    columns: Array

    def criterion(self, kind: Criterion) -> tuple[float, Array]:
        """Cost that decreases with the information, and its gradient (m, p) by the columns."""
        W = self.columns
        scale = np.sqrt((W * W).mean(axis=0)) + INFORMATION.min_eigenvalue
        scaled = W / scale
        gram = scaled.T @ scaled / len(W)
        values, vectors = np.linalg.eigh(gram)
        values = np.maximum(values, INFORMATION.min_eigenvalue)
        if kind == "d":
            # -log det of the information; the scale contributes its logarithm
            cost = -float(np.log(values).sum()) - 2 * float(np.log(scale).sum())
            return cost / W.shape[1], -2 * (scaled @ (vectors / values @ vectors.T)) / (
                scale * W.size
            )
        exponent = INFORMATION.smooth_power
        power = (values**-exponent).mean() ** (1 / exponent)
        weight = -(power ** (1 - exponent)) * values ** (-exponent - 1) / len(values) / power
        by_gram = vectors * weight @ vectors.T
        by_scaled = 2 * scaled @ by_gram / len(W)
        # scaled = W / scale, and the scale depends on W
        along = (by_scaled * scaled).sum(axis=0) / len(W)
        return float(np.log(power)), (by_scaled - scaled * along) / scale

    def condition(self, scaled: bool) -> float:
        """Condition number of the columns, as they are or scaled to unit length."""
        W = self.columns / np.linalg.norm(self.columns, axis=0) if scaled else self.columns
        return float(np.linalg.cond(W))

    def deviations(self, samples: float) -> Array:
        """Predicted standard deviations (p,) of the parameters.

        Args:
            samples: number of independent measurements in all rows together.
        """
        size = np.linalg.norm(self.columns, axis=0)
        # a motion without any effect of a parameter has a column of zeros
        scale = np.where(size > 0, size, 1.0)
        # not by the inverse of the information, whose condition is the square of the columns'
        _, values, vectors = np.linalg.svd(self.columns / scale, full_matrices=False)
        values = np.maximum(values, np.finfo(float).eps * values.max())
        spread = np.linalg.norm(vectors / values[:, None], axis=0) / scale
        return np.asarray(spread * np.sqrt(len(self.columns) / samples))
