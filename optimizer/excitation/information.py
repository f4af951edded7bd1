"""How well a motion tells parameters apart: criterion with its gradient, condition, and predicted
deviations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.excitation.excitation_problem import Criterion

# eigenvalue of the scaled information that counts as zero
_SINGULAR = 1e-12
# exponent of the smooth condition: the mean of the eigenvalues' inverses to this power
_POWER = 4


@dataclass(frozen=True)
class Information:
    """Columns (m, p) of a motion, each row over the noise of its torque."""

    columns: Array

    def criterion(self, kind: Criterion) -> tuple[float, Array]:
        """A cost that falls as the parameters become better told apart, and its gradient (m, p) by
        the columns.
        """
        W = self.columns
        scale = np.sqrt((W * W).mean(axis=0)) + _SINGULAR
        scaled = W / scale
        gram = scaled.T @ scaled / len(W)
        values, vectors = np.linalg.eigh(gram)
        values = np.maximum(values, _SINGULAR)
        if kind == "d":
            # -log det of the information; the scale contributes its logarithm
            cost = -float(np.log(values).sum()) - 2 * float(np.log(scale).sum())
            return cost / W.shape[1], -2 * (scaled @ (vectors / values @ vectors.T)) / (
                scale * W.size
            )
        power = (values**-_POWER).mean() ** (1 / _POWER)
        weight = -(power ** (1 - _POWER)) * values ** (-_POWER - 1) / len(values) / power
        by_gram = vectors * weight @ vectors.T
        by_scaled = 2 * scaled @ by_gram / len(W)
        # scaled = W / scale, and the scale moves with W
        along = (by_scaled * scaled).sum(axis=0) / len(W)
        return float(np.log(power)), (by_scaled - scaled * along) / scale

    def condition(self, scaled: bool) -> float:
        """Condition of the columns, as they are or scaled to one length."""
        W = self.columns / np.linalg.norm(self.columns, axis=0) if scaled else self.columns
        return float(np.linalg.cond(W))

    def deviations(self, samples: float) -> Array:
        """Standard deviations (p,) of the parameters if the rows hold `samples` independent
        measurements in all.
        """
        gram = self.columns.T @ self.columns * (samples / len(self.columns))
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(gram))))
