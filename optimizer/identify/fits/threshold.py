"""Speed below which Coulomb and viscous friction do not hold (Vuong and Ang 2009).

Near standstill, friction is no function of the speed: bristles bend, and the film of lubricant is
not yet there. Samples below a threshold would bias the figures. Residuals of a fit to fast samples
are averaged in classes of speed. The threshold is the upper edge of the fastest class whose mean
residual exceeds its statistical error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.friction_columns import columns
from joulepath.optimizer.identify.rows.fit_rows import Rows

_TERMS = ("coulomb", "viscous", "offset")


@dataclass(frozen=True)
class ThresholdSettings:
    """Settings of the search for threshold speeds."""

    classes: int = 30
    """Number of classes of speed, evenly spaced in the logarithm."""
    speed_range: float = 1000.0
    """Greatest speed over the lower edge of the slowest class [1]."""
    min_samples: int = 10
    """Smallest number of samples of a class."""
    min_deviations: float = 4.0
    """Standard errors of the mean that a significant mean residual exceeds."""
    min_share: float = 0.05
    """Share of the Coulomb friction that a significant mean residual exceeds; less does not bias
    the figures."""
    knee: float = 1e-4
    """Speed over which Coulomb friction reverses [rad/s]; far below every class."""
    fast_share: float = 0.25
    """Share of the greatest speed above which the friction law is assumed to hold."""


THRESHOLD = ThresholdSettings()


def velocity_threshold(v: Array, friction: Array, settings: ThresholdSettings = THRESHOLD) -> float:
    """Threshold speed of a joint.

    Args:
        v: velocities (n,) [rad/s].
        friction: friction torques (n,) [N·m].
        settings: settings of the search.

    Returns:
        The threshold [rad/s]; 0 if the friction law holds at all speeds.
    """
    speed, greatest = np.abs(v), float(np.abs(v).max())
    fast = speed > settings.fast_share * greatest
    matrix = columns(_TERMS, v, v, v, settings.knee)
    figures, *_ = np.linalg.lstsq(matrix[fast], friction[fast], rcond=None)
    # positive where the drag is too large, in either direction
    error = np.sign(v) * (friction - matrix @ figures)
    edges = np.geomspace(
        greatest / settings.speed_range, settings.fast_share * greatest, settings.classes + 1
    )
    number = np.digitize(speed, edges)
    found = 0.0
    for k in range(1, settings.classes + 1):
        part = error[number == k]
        if len(part) >= settings.min_samples:
            by_chance = settings.min_deviations * float(part.std(ddof=1)) / np.sqrt(len(part))
            if abs(float(part.mean())) > max(by_chance, settings.min_share * float(figures[0])):
                found = float(edges[k])
    return found


def thresholds_of(arm: FittedArm, rows: Rows, torque: Array) -> Array:
    """Threshold speeds (nq,) [rad/s], 0 for none, from motor torques (n, nq) [N·m]."""
    friction = torque - arm.link_torque(rows)
    use = np.isfinite(friction) & (rows.v != 0) & ~rows.rest[:, None]
    joints = [(rows.v[use[:, j], j], friction[use[:, j], j]) for j in range(rows.v.shape[1])]
    return np.array([velocity_threshold(v, part) if v.size else 0.0 for v, part in joints])


def without_slow_efforts(rows: Rows, thresholds: Array) -> Rows:
    """Rows without the efforts of joints slower than their thresholds (nq,) [rad/s]."""
    return replace(rows, effort=np.where(np.abs(rows.v) > thresholds, rows.effort, np.nan))
