"""Lower bound on the electrical net energy of motions, from their displacement and potential gain.

`electrical` states the bound and proves it; `NetEnergy` evaluates and minimises it over the
duration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.cruise import TINY, Cruise, copper_loss
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class SecantSettings:
    """Settings of the secant method for the duration of least energy."""

    most_points: int = 12
    """Largest number of durations evaluated."""
    first_exponent: float = 1.7
    """Power of the duration with which the loss is first assumed to fall."""
    tolerance: float = 1e-9
    """Relative error of the least energy at which the method ends."""


KNEE_DEFICIT = 0.3003
"""Greatest x - x² / sqrt(x² + 1) over x ≥ 0, rounded up.

Times the knee it is the greatest difference between |v| and Coulomb friction's v · tau_f(v) per
unit of its torque.
"""
SECANT = SecantSettings()


def electrical(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    t_min: Array,
    t_max: Array,
    waiting: Array,
) -> Array:
    """Lower bound on the electrical energy of motions with given joint displacements.

    **Bus.** Energy ≥ ∫ P_net dt = base · T + potential gain + friction + copper + inverter on every
    bus:

    - shared: drawn = max(P_net, 0) ≥ P_net. If a share below 1 is given back, max(P_net, 0) - share
      · max(-P_net, 0) = P_net + (1 - share) max(-P_net, 0) ≥ P_net. On a recuperating bus, the
      share is the efficiency.
    - isolated: drawn = base + Σ max(P_j, 0) ≥ base + Σ P_j = P_net.
    - storage: let s be the net surplus, c ≤ s its part that charges the store. The total is
      ∫ (max(P_net, 0) - efficiency · c - share · (s - c)) dt (see `energy.bus_flow`) ≥ ∫ P_net dt,
      as neither factor exceeds 1. The total contains the fall of the charge, so the bound holds for
      any initial charge.

    **Load.** Friction that grows with the load is left out: only that of an unloaded joint counts.

    **Copper.** Let c = (copper + quadratic inverter loss) / torque_constant² [W/(N·m)²] per joint,
    and η ≥ 0 one number for all joints. Then c (tau + tau_f)² ≥ 2 η v (tau + tau_f) - η² v² / c,
    because the difference is a square. Σ v (tau + tau_f) is the rate of mechanical energy plus
    friction, so the loss is at least 2 η (potential gain + friction) - η² Σ ∫ v² / c dt. Other
    losses of holding against gravity and of the inverter are left out.

    **Friction.** v · tau_f(v) ≥ coulomb |v| + g(|v|) - deficit, with the convex function g(v) = v
    (curved asinh(v / speed) + viscous v). The Coulomb part is at least coulomb · |displacement|.
    For the rest, let m(h) be the time during which |v| exceeds h. Then ∫ g dt = ∫ g'(h) m(h) dh,
    ∫ m(h) dh ≥ |displacement|, and m(h) ≤ T - 2 t(h), where t(h) ≥ h / a_max is the least time from
    rest to the speed h, with half a jerk ramp more if h is above half the ramp's speed. As g'
    grows, the least integral fills m up to its limit from h = 0 on, until the displacement is
    reached at h = c:

        |displacement| = ∫_0^c (T - 2 t(h)) dh,      ∫ g dt ≥ ∫_0^c g'(h) (T - 2 t(h)) dh.

    **Duration.** The latter is the value of a linear program with a right-hand side linear in T: it
    is convex in T, with the slope g(c) - c g'(c). The same holds for (1 + 2 η) g(v) - η² v² / c
    instead of g as long as this function is convex up to the greatest speed, which limits η. For
    each T the bound is a parabola in η, and its greatest value is known. The maximum of convex
    functions is convex: `NetEnergy.least` finds the minimum over [t_min, t_max].

    Args:
        prepared: problem of the motions.
        displacement: joint displacements, shape (P, nq) [rad].
        potential_gain: gains of potential energy, shape (P,) [J].
        t_min: least durations, shape (P,) [s].
        t_max: greatest durations, shape (P,) [s].
        waiting: power saved by every second of the motion, shape (P,) [W]; 0 without a dwell.

    Returns:
        Bounds, shape (P,) [J].
    """
    return NetEnergy.for_motions(prepared.arm, displacement, potential_gain, waiting).least(
        t_min, t_max
    )


def copper_multiplier(
    prepared: PreparedProblem, displacement: Array, potential_gain: float, duration: float
) -> float:
    """The η for which the bound of `electrical` is greatest at one duration.

    Args:
        prepared: problem of the motions.
        displacement: joint displacement, shape (nq,) [rad].
        potential_gain: gain of potential energy [J].
        duration: duration [s].
    """
    net = NetEnergy.for_motions(prepared.arm, displacement[None], np.array([potential_gain]))
    return float(net.multiplier(np.array([duration]))[0])


@dataclass(frozen=True)
class NetEnergy:
    """The bound of `electrical` as a function of the duration T, for P motions."""

    cruise: Cruise
    """Least losses of friction and of ∫ v² / c dt."""
    power: Array
    """Power drawn at all times, shape (P,) [W]."""
    work: Array
    """Gain of potential energy plus Coulomb loss, shape (P,) [J], without the deficit."""
    deficit: float
    """Power [W] by which Coulomb friction's knee reduces the Coulomb loss."""
    most: float
    """Greatest η."""

    @staticmethod
    def of(
        arm: Arm, cruise: Cruise, potential_gain: Array, waiting: Array, most: float
    ) -> NetEnergy:
        """The bound from least losses; `potential_gain` and `waiting` (P,) as in `electrical`."""
        law = arm.friction_law
        power = arm.base_power + float(arm.drives.inverter_constant.sum()) - waiting
        deficit = KNEE_DEFICIT * law.knee * float(law.coulomb.sum())
        return NetEnergy(
            cruise, power, potential_gain + cruise.distance @ law.coulomb, deficit, most
        )

    @staticmethod
    def for_motions(
        arm: Arm, displacement: Array, gain: Array, waiting: Array | float = 0.0
    ) -> NetEnergy:
        """The bound of motions from rest to rest; the arguments are those of `electrical`."""
        cruise = Cruise(np.abs(displacement), arm)
        return NetEnergy.of(arm, cruise, gain, waiting + np.zeros(len(gain)), most_copper(arm))

    def __getitem__(self, k: Indices) -> NetEnergy:
        return replace(self, cruise=self.cruise[k], power=self.power[k], work=self.work[k])

    def at(self, T: Array) -> tuple[Array, Array]:
        """The bounds (P,) [J] for durations T (P,) [s], and their derivatives [W]."""
        friction, friction_slope, square, square_slope = self.cruise.losses(T)
        work = self.work + friction - self.deficit * T
        eta = self._best(work, square)
        more, squared = 1 + 2 * eta, eta * eta
        slope = self.power + more * (friction_slope - self.deficit) - squared * square_slope
        return self.power * T + more * work - squared * square, slope

    def multiplier(self, T: Array) -> Array:
        """The η (P,) for which the bounds at durations T (P,) [s] are greatest."""
        friction, _, square, _ = self.cruise.losses(T)
        return self._best(self.work + friction - self.deficit * T, square)

    def _best(self, work: Array, square: Array) -> Array:
        return np.clip(work / np.maximum(square, TINY), 0.0, self.most)

    def least(self, t_min: Array, t_max: Array) -> Array:
        """Least bounds (P,) [J] over durations from t_min to t_max (P,) [s], at least t_min."""
        rate, longest = self.power - self.deficit, np.maximum(t_min, t_max)
        value, slope = self.at(np.where(rate > 0, t_min, longest))
        # most motions need least energy at their shortest duration
        slower = np.flatnonzero((rate > 0) & (slope < 0) & (t_min < longest))
        if len(slower):
            value[slower] = self[slower]._least_beyond(
                t_min[slower], slope[slower], longest[slower]
            )
        return value

    def _least_beyond(self, low: Array, slope: Array, high: Array) -> Array:
        """Least bounds (P,) [J] over durations from `low` to `high` (P,) [s].

        The bounds fall with `slope` (P,) [W] at `low`. A convex function stays above its tangents:
        the greatest possible fall below the last value, over the interval that holds the minimum,
        is subtracted. The loss falls nearly with a power of the duration, so the secant method
        works on logarithms of the duration and of the ratio of the loss's fall to the power; a step
        that leaves the interval is replaced by bisection.
        """
        settings = SECANT
        rate, low, high = self.power - self.deficit, np.log(low), np.log(high)
        x, excess = low, np.log(1 - slope / rate)
        value, missed = np.zeros_like(low), np.full_like(low, np.inf)
        step, done = excess / settings.first_exponent, np.zeros(len(x), dtype=bool)
        for _ in range(settings.most_points):
            if done.all():
                break
            ahead = np.where((x + step > low) & (x + step < high), x + step, (low + high) / 2)
            ahead = np.where(done, x, ahead)
            T = np.exp(ahead)
            value, slope = self.at(T)
            with np.errstate(divide="ignore", invalid="ignore"):
                # the quotient is undefined for a repeated point, and the logarithm for a steep rise
                new_excess = np.log(1 - slope / rate)
                step = new_excess * (ahead - x) / (excess - new_excess)
            low, high = np.where(slope < 0, ahead, low), np.where(slope < 0, high, ahead)
            x, excess = ahead, new_excess
            missed = np.maximum(slope * (T - np.exp(low)), slope * (T - np.exp(high)))
            done = missed <= settings.tolerance * rate * T
        return value - missed


@dataclass(frozen=True)
class FixedCopperEnergy(NetEnergy):
    """The bound with the same η for all motions.

    It rises by 1 + 2 η per joule of potential gain, so that the gains of successive motions may be
    added up before they are bounded.
    """

    @classmethod
    def without_gain(cls, arm: Arm, displacement: Array, eta: float) -> FixedCopperEnergy:
        """The bound of motions from rest to rest without potential gain.

        Args:
            arm: the arm.
            displacement: joint displacements, shape (P, nq) [rad].
            eta: the η, at most `most_copper`.
        """
        none = np.zeros(len(displacement))
        return cls(**vars(NetEnergy.of(arm, Cruise(np.abs(displacement), arm), none, none, eta)))

    def _best(self, work: Array, square: Array) -> Array:
        return np.full_like(work, self.most)


def most_copper(arm: Arm) -> float:
    """Greatest η of `electrical`; 0 for a friction law with a negative coefficient.

    The second derivative g'' is least at the greatest speed. Convexity requires (1 + 2 η) g'' - 2
    η² / c ≥ 0 there.
    """
    law, v, c = arm.friction_law, arm.active_limits.v_max, copper_loss(arm)
    if min(law.coulomb.min(), law.curved.min(), law.viscous.min()) < 0:
        return 0.0
    bent = law.loss_curvature(v)
    return float((c * bent + np.sqrt(c * bent * (c * bent + 2))).min()) / 2
