"""The greatest value over a joint's speed of what a multiplier gains and friction takes, bounded from above."""

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
    """A concave friction torque between nodes of speed, per interval (k, nq): first and last speed [rad/s], the chord's
    value at speed 0 and slope, and how far the torque rises above its chord at most [N·m].

    The torque is that of unloaded joints. `load` (nq,) is the share of the carried torque that is lost, too; None for a
    law without it.
    """

    first: Array
    last: Array
    constant: Array
    slope: Array
    sagitta: Array
    load: Array | None = None

    @classmethod
    def of(cls, law: FrictionLaw, v_max: Array) -> FrictionConjugate | None:
        """The intervals up to v_max (nq,); None for a law that is not concave: one with a negative coefficient."""
        if min(law.coulomb.min(), law.curved.min(), law.viscous.min()) < 0 or law.knee <= 0 or law.speed.min() <= 0:
            return None
        if law.load is not None and not ((law.load >= 0) & (law.load < 1)).all():
            return None
        knees = np.outer(_IN_KNEES, np.minimum(law.knee, _MOST_KNEE / _IN_KNEES[-1] * v_max))
        v = np.concatenate([np.zeros((1, len(v_max))), knees, np.outer(_SHARES, v_max)])
        torque, step = law.unloaded.torque(v), np.diff(v, axis=0)
        rate = law.coulomb * law.knee**2 / (v * v + law.knee**2) ** 1.5 + law.curved / np.hypot(v, law.speed)
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

    def greatest(self, p: Array, omega: Array, square: Array, most: Array) -> tuple[Array, Array]:
        """Upper bounds (..., nq) on max over |v| ≤ most of p v - (v + omega) tau_f(v) + square v², and where it is.

        For v ≥ 0 the torque is between its chord and the chord plus the sagitta. So (v + omega) tau_f(v) ≥ (v + omega)
        chord - max(-(first + omega), 0) sagitta, a quadratic function of v, whose greatest value on an interval is
        known. For v < 0 the same holds with -v, -p, -omega, as the torque is odd. Against p a value is at most that of
        p v + square v² at an end, or zero, and what friction helps omega by at the greatest torque: where that is no
        more than the value along p, it is left out.

        Where friction grows with the load, ω̂ stands in the place of omega: that of all from omega / (1 + load) to
        omega / (1 - load) at which ω̂ tau_f(v) is least.
        """
        shape = np.broadcast_shapes(p.shape, omega.shape, square.shape, most.shape)
        best, where = np.zeros(shape), np.zeros(shape)
        limit = most[..., None, :]
        low, high = np.minimum(self.first, limit), np.minimum(self.last, limit)
        second = square[..., None, :] - self.slope
        bent = second < 0
        fastest = (self.constant + self.slope * self.last)[-1]
        for way in (1.0, -1.0):
            sign = way * np.where(p < 0, -1.0, 1.0)
            shift = sign * omega
            if self.load is not None:
                shift = shift / np.where(shift > 0, 1 + self.load, 1 - self.load)
            reach = (
                np.maximum((sign * p + np.maximum(square, 0.0) * most) * most, 0.0) + np.maximum(-shift, 0.0) * fastest
            )
            shift = np.broadcast_to(shift, shape)[..., None, :]
            rate = (sign * p)[..., None, :] - self.constant - shift * self.slope
            v = np.clip(np.where(bent, -rate / np.where(bent, 2 * second, -1.0), high), low, high)
            value = np.maximum((second * v + rate) * v, (second * low + rate) * low)
            value = value - shift * self.constant + np.maximum(-(self.first + shift), 0.0) * self.sagitta
            value = np.where(self.first <= limit, value, -np.inf)
            k = value.argmax(axis=-2)[..., None, :]
            own = np.take_along_axis(value, k, axis=-2)[..., 0, :]
            at = np.take_along_axis(np.broadcast_to(v, value.shape), k, axis=-2)[..., 0, :]
            better = (own > best) & ((way > 0) | (reach > best))
            best, where = np.where(better, own, best), np.where(better, sign * at, where)
        return best, where

    def stiffness(self, law: FrictionLaw) -> Array:
        """About the least second derivative (nq,) of v tau_f(v) beyond Coulomb friction's step; a choice, no bound."""
        v = self.last
        bent = np.hypot(v, law.speed)
        return np.asarray((2 * (law.curved / bent + law.viscous) - law.curved * v * v / bent**3).min(axis=0))
