"""The greatest value over a joint's speed of what a multiplier gains and friction takes, bounded
from above.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, FrictionLaw

# ends of the intervals of speed: in knees of Coulomb friction, and as shares of the greatest speed
_IN_KNEES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
_SHARES = (0.02, 0.05, 0.09, 0.14, 0.2, 0.27, 0.35, 0.44, 0.55, 0.67, 0.82, 1.0)
# the knees' nodes stay below this share of the greatest speed
_MOST_KNEE = 0.01


@dataclass(frozen=True)
class FrictionConjugate:
    """A concave friction torque between nodes of speed, per interval (k, nq): first and last speed
    [rad/s], the chord's value at speed 0 and slope, and how far the torque rises above its chord at
    most [N·m].

    The C of `speed_conjugate` computes the greatest values. The torque is that of unloaded joints.
    `load` (nq,) is the share of the carried torque that is lost, too; None for a law without it.
    """

    first: Array
    last: Array
    constant: Array
    slope: Array
    sagitta: Array
    load: Array | None = None

    @classmethod
    def of(cls, law: FrictionLaw, v_max: Array) -> FrictionConjugate | None:
        """The intervals up to v_max (nq,); None for a law that is not concave: one with a negative
        coefficient.
        """
        if (
            min(law.coulomb.min(), law.curved.min(), law.viscous.min()) < 0
            or law.knee <= 0
            or law.speed.min() <= 0
        ):
            return None
        if law.load is not None and not ((law.load >= 0) & (law.load < 1)).all():
            return None
        knees = np.outer(_IN_KNEES, np.minimum(law.knee, _MOST_KNEE / _IN_KNEES[-1] * v_max))
        v = np.concatenate([np.zeros((1, len(v_max))), knees, np.outer(_SHARES, v_max)])
        torque, step = law.unloaded.torque(v), np.diff(v, axis=0)
        rate = law.coulomb * law.knee**2 / (v * v + law.knee**2) ** 1.5 + law.curved / np.hypot(
            v, law.speed
        )
        rate = rate + law.viscous
        slope = np.diff(torque, axis=0) / step
        # between two nodes the torque is below its tangents at both, which meet `at` from the first
        bend = np.maximum(rate[:-1] - rate[1:], 1e-12)
        at = np.clip((np.diff(torque, axis=0) - rate[1:] * step) / bend, 0.0, step)
        sagitta = np.maximum((rate[:-1] - slope) * at, 0.0)
        return cls(v[:-1], v[1:], torque[:-1] - slope * v[:-1], slope, sagitta, law.load)

    @cached_property
    def by_joint(self) -> tuple[Array, ...]:
        """`first`, `last`, `constant`, `slope` and `sagitta`, (nq, k) each."""
        intervals = self.first, self.last, self.constant, self.slope, self.sagitta
        return tuple(np.ascontiguousarray(each.T) for each in intervals)

    def stiffness(self, law: FrictionLaw) -> Array:
        """About the least second derivative (nq,) of v tau_f(v) beyond Coulomb friction's step; a
        choice, no bound.
        """
        v = self.last
        bent = np.hypot(v, law.speed)
        return np.asarray(
            (2 * (law.curved / bent + law.viscous) - law.curved * v * v / bent**3).min(axis=0)
        )
