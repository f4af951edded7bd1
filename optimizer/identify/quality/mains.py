"""Power of the control box from the mains, by readings of a wattmeter in its cable.

    mains = factor · bus + constant [W]

`factor` describes the loss of the power supply, `constant` the power of computer, teach pendant and
fans. The mean reading during a log gives one equation. Readings at rest and in motion determine
both figures; with a single reading, the factor keeps its prior.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.quality.answered import AnsweredEnergies
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class MainsSettings:
    """Settings of the fit of readings."""

    factor: float = 1.1
    """Factor before any reading [1]: supplies of this size have an efficiency near 91 %."""
    factor_sd: float = 0.04
    """Its standard deviation [1]: an efficiency from 85 to 97 % with 90 % probability."""
    meter_sd: float = 0.01
    """Standard deviation of a reading, over the reading [1]: a meter of class 1."""
    max_sd_ratio: float = 0.7
    """Standard deviation of the factor over that before any reading, above which the factor is not
    identified [1]."""


MAINS = MainsSettings()


@dataclass(frozen=True)
class IdentifiedMains:
    """Factor [1] and constant [W], with their standard deviations."""

    factor: float
    factor_sd: float
    constant: float
    constant_sd: float

    def figures(self, source: str) -> dict[str, Any]:
        """The figures of a document with this source."""
        told = self.factor_sd <= MAINS.max_sd_ratio * MAINS.factor_sd
        default = "none: engineering default, the efficiency of power supplies of this size"
        return {
            "factor": {
                "value": self.factor,
                "unit": "1",
                "source": source if told else default,
                "trust": "B" if told else "E",
                "sd": self.factor_sd,
            },
            "constant": {
                "value": self.constant,
                "unit": "W",
                "source": source,
                "trust": "B",
                "sd": self.constant_sd,
            },
        }


def fit_mains(
    energies: AnsweredEnergies, rows: Rows, readings: Sequence[float | None]
) -> IdentifiedMains | None:
    """Fit the figures of the control box by weighted least squares with a prior on the factor.

    Args:
        energies: energies of the fitted arm, used for logs without power.
        rows: rows of all logs.
        readings: mean power of the meter by log [W]; None for a log without a reading.

    Returns:
        The figures; None without a reading.

    Raises:
        InvalidProblem: a reading is below the power drawn from the bus.
    """
    if not any(readings):
        return None
    settings = MAINS
    lines, values, weights = [[1.0, 0.0]], [settings.factor], [1 / settings.factor_sd]
    for log, reading in enumerate(readings):
        if reading is None:
            continue
        drawn, sd = _mean_power(energies, rows.take(rows.log == log))
        if reading < drawn - P95 * sd:
            raise InvalidProblem(
                "mains",
                f"The wattmeter showed {reading:g} W during log {log + 1}, and the arm alone drew "
                f"{drawn:.3g} W from its bus: read the mean power in the mains cable of the "
                "control box.",
            )
        lines.append([drawn, 1.0])
        values.append(reading)
        weights.append(1 / float(np.hypot(settings.meter_sd * reading, settings.factor * sd)))
    equations = np.array(lines) * np.array(weights)[:, None]
    covariance = np.linalg.inv(equations.T @ equations)
    factor, constant = (covariance @ equations.T @ (np.array(values) * weights)).tolist()
    sd = np.sqrt(np.diag(covariance)).tolist()
    return IdentifiedMains(max(factor, 1.0), sd[0], max(constant, 0.0), sd[1])


def _mean_power(energies: AnsweredEnergies, rows: Rows) -> tuple[float, float]:
    """Mean power on the bus [W], as logged or else as predicted, and its standard deviation, 0 if
    it was logged."""
    time = float(rows.weight.sum())
    if np.isfinite(rows.power).all():
        return float(rows.weight @ rows.power) / time, 0.0
    return energies.fitted.energy(rows) / time, float(np.sqrt(energies.variance(rows))) / time
