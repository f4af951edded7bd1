"""The speed below which Coulomb and viscous friction do not hold (Vuong and Ang 2009).

Near standstill friction is no function of the speed: bristles bend, and the lubricant's film is not
there yet. Samples below a threshold would bias the figures. Here the residuals of a fit to fast
samples are averaged in classes of speed. The threshold is the greatest speed below which a class is
off by more than it can be by chance.
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
    """How a threshold is sought."""

    classes: int = 30
    """Classes of speed, evenly spaced in its logarithm."""
    least_samples: int = 10
    """Samples of a class whose mean counts."""
    deviations: float = 4.0
    """Standard deviations of its mean by which a class is off."""
    share: float = 0.05
    """Share of the Coulomb friction by which a class is off at least: less does not bias the
    figures."""
    knee: float = 1e-4
    """Speed over which Coulomb friction reverses [rad/s]; far below every class."""
    fast: float = 0.25
    """Share of the greatest speed above which the law is taken to hold."""


def velocity_threshold(
    v: Array, friction: Array, settings: ThresholdSettings | None = None
) -> float:
    """The threshold [rad/s] of a joint with friction torques (n,) [N·m] at speeds v (n,); 0 if
    there is none.
    """
    settings = settings or ThresholdSettings()
    speed, greatest = np.abs(v), float(np.abs(v).max())
    fast = speed > settings.fast * greatest
    matrix = columns(_TERMS, v, v, v, settings.knee)
    figures, *_ = np.linalg.lstsq(matrix[fast], friction[fast], rcond=None)
    # a drag that is too small or too great in both directions
    error = np.sign(v) * (friction - matrix @ figures)
    edges = np.geomspace(greatest / 1000, settings.fast * greatest, settings.classes + 1)
    number = np.digitize(speed, edges)
    found = 0.0
    for k in range(1, settings.classes + 1):
        part = error[number == k]
        if len(part) >= settings.least_samples:
            by_chance = settings.deviations * float(part.std(ddof=1)) / np.sqrt(len(part))
            if abs(float(part.mean())) > max(by_chance, settings.share * float(figures[0])):
                found = float(edges[k])
    return found


def thresholds_of(arm: FittedArm, rows: Rows, torque: Array) -> Array:
    """The threshold (nq,) [rad/s] of each joint, from motor torques (n, nq) [N·m]; 0 where there is
    none."""
    friction = torque - arm.link_torque(rows)
    use = np.isfinite(friction) & (rows.v != 0) & ~rows.rest[:, None]
    joints = [(rows.v[use[:, j], j], friction[use[:, j], j]) for j in range(rows.v.shape[1])]
    return np.array([velocity_threshold(v, part) if v.size else 0.0 for v, part in joints])


def faster(rows: Rows, thresholds: Array) -> Rows:
    """The rows without the efforts of joints that are slower than their thresholds (nq,)
    [rad/s]."""
    return replace(rows, effort=np.where(np.abs(rows.v) > thresholds, rows.effort, np.nan))
