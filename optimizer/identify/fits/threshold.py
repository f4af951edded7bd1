"""The speed below which Coulomb and viscous friction do not hold (Vuong and Ang 2009).

Near standstill friction is no function of the speed: bristles bend, and the lubricant's film is not there yet. Samples
below a threshold would bias the figures. Here the residuals of a fit to fast samples are averaged in classes of speed.
The threshold is the greatest speed below which a class is off by more than it can be by chance.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.arm.friction_columns import columns

CLASSES = 30
# samples that a class has at least, standard deviations by which it is off, and share of the friction
LEAST, SDS, SHARE = 10, 4.0, 0.05
TERMS = ("coulomb", "viscous", "offset")
# rad/s; the step of Coulomb friction is far below every class
KNEE = 1e-4
FAST = 0.25


def velocity_threshold(v: Array, friction: Array) -> float:
    """The threshold [rad/s] of a joint with friction torques (n,) [N·m] at speeds v (n,); 0 if there is none."""
    speed, greatest = np.abs(v), float(np.abs(v).max())
    fast = speed > FAST * greatest
    matrix = columns(TERMS, v, v, v, KNEE)
    figures, *_ = np.linalg.lstsq(matrix[fast], friction[fast], rcond=None)
    # a drag that is too small or too great in both directions
    error = np.sign(v) * (friction - matrix @ figures)
    edges = np.geomspace(greatest / 1000, FAST * greatest, CLASSES + 1)
    number = np.digitize(speed, edges)
    found = 0.0
    for k in range(1, CLASSES + 1):
        part = error[number == k]
        if len(part) >= LEAST:
            by_chance = SDS * float(part.std(ddof=1)) / np.sqrt(len(part))
            if abs(float(part.mean())) > max(by_chance, SHARE * float(figures[0])):
                found = float(edges[k])
    return found
