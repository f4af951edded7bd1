"""Lower bounds on the objective of all motions, of any shape and any allowed duration, between two configurations.

Each term below is proven in its function's docstring; their sum is minimised over the duration.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from models.robot import Array, FrictionLaw, Limits
from optimizer.energy.dwell import holding_power, linear_dwells
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION
from optimizer.trajectories.seven_segment import shortest_duration

# max over x ≥ 0 of x - x² / sqrt(x² + 1), rounded up: what spreading Coulomb friction's jump takes from |v|, in knees
_KNEE_DEFICIT = 0.3003
# duration of a part of a motion [s] that stands for none
SHORTEST_PART = 1e-12
# points of the secant method for the best duration at most; how steep it takes the loss to fall with the duration at
# first; and the share of its cost to which a duration is the best one
_POINTS, _FALL, _EXACT = 12, 1.7, 1e-9


def lower_bounds(
    prepared: PreparedProblem, displacement: Array, potential_gain: Array, hold: Array | None = None
) -> tuple[Array, Array]:
    """Bounds (P,) on the problem's objective [J] and least durations (P,) [s] for candidates.

    displacement (P, nq) [rad] is goal - start, potential_gain (P,) [J] the gain of potential energy, `hold` (P,) [W]
    the power that holding the goal draws, needed for a problem with a cycle. A candidate whose least duration exceeds
    the longest allowed one has the bound inf.

    Waiting draws constant - power · T on each of its linear pieces (see `optimizer.energy.dwell`): there it is a
    constant and a power less for every second of the motion, and the least over the pieces is a bound for all
    durations.
    """
    problem = prepared.problem
    shortest = np.maximum(shortest_duration(displacement, problem.arm.active_limits), LEAST_DURATION)
    t_min = np.maximum(shortest, problem.duration_min or 0.0)
    t_max = np.full_like(t_min, LONGEST_DURATION if problem.duration_max is None else problem.duration_max)
    if problem.objective == "mechanical":
        bound = mechanical(potential_gain)
    elif problem.cycle is None or hold is None:
        bound = _least_drawn(prepared, displacement, potential_gain, t_min, t_max, np.zeros_like(potential_gain))
    else:
        bound = np.full_like(potential_gain, np.inf)
        for piece in linear_dwells(problem.cycle, problem.arm, hold):
            low, high = np.maximum(t_min, piece.t_min), np.minimum(t_max, piece.t_max)
            value = piece.constant + _least_drawn(prepared, displacement, potential_gain, low, high, piece.power)
            bound = np.where(low <= high, np.minimum(bound, value), bound)
    return np.where(t_min > t_max, np.inf, bound), shortest


def priced_bounds(
    prepared: PreparedProblem, displacement: Array, potential_gain: Array, price: float, longest: float
) -> Array:
    """Bounds (P,) [J] on energy + price · duration of motions that last at most `longest` [s]; inf for those that last
    longer in any case.

    displacement (P, nq) [rad] and potential_gain (P,) [J] as in `lower_bounds`; `price` [W] of time may be negative.
    """
    shortest = np.maximum(shortest_duration(displacement, prepared.arm.active_limits), LEAST_DURATION)
    t_max, waiting = np.full_like(shortest, longest), np.full_like(shortest, -price)
    bound = _least_drawn(prepared, displacement, potential_gain, shortest, t_max, waiting)
    return np.where(shortest > longest, np.inf, bound)


def travel_bounds(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    price: float = 0.0,
    longest: float = LONGEST_DURATION,
) -> Array:
    """Bounds (P,) [J] on energy + price · duration of parts of a motion that may begin and end at any speed.

    displacement (P, nq) [rad] and potential_gain (P,) [J] are those of the parts; `price` [W] of time, no part longer
    than `longest` [s]. What a part draws may be less than its bound, by the kinetic energy that it begins with. But the
    sum over the parts of a motion from rest to rest is a bound on this motion: its kinetic energy adds up to zero, and
    ∫ P_net dt is bounded as in `electrical`, with three changes. A joint may have any speed at once, so the share of
    friction that grows with speed is at least that of even speed, T g(|displacement| / T), as g is convex (Jensen). The
    least duration is that of the speed limits alone. And the bound by the drawn power, which is never negative, is left
    out: it holds for each part, but the greater of the two bounds in each part does not, since a part may draw less for
    what another one has put into speed.
    """
    distance, limits = np.abs(displacement), prepared.arm.active_limits
    t_min = np.maximum((distance / limits.v_max).max(axis=-1), SHORTEST_PART)
    cruise = _Even(distance, prepared.arm.friction_law, limits)
    waiting = np.full_like(t_min, -price)
    bound = _net_energy(prepared, cruise, potential_gain, t_min, np.full_like(t_min, longest), waiting)
    return np.where(t_min > longest, np.inf, bound)


@dataclass(frozen=True)
class LeastBound:
    """`lower_bounds` of a problem for motions of which only the least displacement and potential gain are known."""

    prepared: PreparedProblem

    def of(self, displacement: Array, potential_gain: Array) -> Array:
        """Bounds (b,) [J] for joint displacements (b, nq) [rad] and gains of potential energy (b,) [J], or more."""
        if self.prepared.problem.objective == "mechanical":
            potential_gain = np.maximum(potential_gain, 0.0)  # that bound is |gain|, of which zero is the least
        return lower_bounds(self.prepared, displacement, potential_gain, np.full_like(potential_gain, self._hold))[0]

    @cached_property
    def _hold(self) -> float:
        """Least power [W] to stand still: with no torque to hold."""
        return float(holding_power(self.prepared.arm, np.zeros(self.prepared.arm.robot.nq)))


def mechanical(potential_gain: Array) -> Array:
    """Bound on ∫ Σ |tau_j v_j| dt [J]: it is at least |∫ tau · v dt|, the change of energy between two rests."""
    return np.abs(potential_gain)


def _least_drawn(
    prepared: PreparedProblem, displacement: Array, potential_gain: Array, t_min: Array, t_max: Array, waiting: Array
) -> Array:
    """The greater of `electrical` and the energy drawn by a motion without any work.

    If the supply takes nothing back and there is no energy storage, the drawn power is never negative. On an isolated
    bus it is never less than that of the electronics, because they cannot use the joints' surplus.
    """
    arm = prepared.arm
    bound = electrical(prepared, displacement, potential_gain, t_min, t_max, waiting)
    if arm.regeneration > 0 or arm.bus.mode == "storage":
        return bound
    rate = (arm.base_power if arm.bus.mode == "isolated" else 0.0) - waiting
    return np.maximum(bound, np.minimum(rate * t_min, rate * np.maximum(t_max, t_min)))


def electrical(
    prepared: PreparedProblem, displacement: Array, potential_gain: Array, t_min: Array, t_max: Array, waiting: Array
) -> Array:
    """Bound on the electrical energy [J] of motions with the given joint displacement (P, nq) and potential_gain (P,)
    [J].

    `waiting` (P,) [W] is what a motion saves by every second that it takes: nothing without a cycle.

    Energy ≥ ∫ P_net dt = base · T + potential_gain + friction + copper + inverter on every bus:

    - shared: drawn = max(P_net, 0) ≥ P_net. With a share below 1 given back, max(P_net, 0) - share · max(-P_net, 0) =
      P_net + (1 - share) max(-P_net, 0) ≥ P_net. So too for a recuperating bus, whose share is its efficiency.
    - isolated: drawn = base + Σ max(P_j, 0) ≥ base + Σ P_j = P_net.
    - storage: with c charged of the net surplus s, total = ∫ (max(P_net, 0) - efficiency · c - share · (s - c)) dt (see
      `energy.bus_flow`) ≥ ∫ P_net dt, as c ≤ s and neither factor exceeds 1. The charge's fall is in the total, so the
      bound holds whatever the store begins with.

    Copper and inverter ≥ their constants. Friction that grows with the load loses v · tau_f(v) of an unloaded joint, or
    more: its share in that is left out.

    friction: v · tau_f(v) ≥ coulomb |v| + g(|v|) - deficit with g(v) = v (curved asinh(v / speed) + viscous v) convex.
    The Coulomb part is at least coulomb · |displacement|. For the rest, let m(h) be how long |v| exceeds h: ∫ g dt =
    ∫ g'(h) m(h) dh, ∫ m(h) dh ≥ |displacement|, and m(h) ≤ T - 2 t(h), where t(h) ≥ h / a_max (and half a jerk ramp
    more above half its speed) is the least time from rest to speed h and back. As g' grows, the least integral fills m
    up to its limit from h = 0 on, until the displacement is reached at h = c:

        |displacement| = ∫_0^c (T - 2 t(h)) dh,      ∫ g dt ≥ ∫_0^c g'(h) (T - 2 t(h)) dh.

    This is the value of a linear program whose right-hand side is linear in T, so it is convex in T, with slope
    g(c) - c g'(c). `_best_durations` finds the least sum in [t_min, t_max].
    """
    cruise = _Cruise(np.abs(displacement), prepared.arm.friction_law, prepared.arm.active_limits)
    return _net_energy(prepared, cruise, potential_gain, t_min, t_max, waiting)


def _net_energy(
    prepared: PreparedProblem, cruise: _Cruise, potential_gain: Array, t_min: Array, t_max: Array, waiting: Array
) -> Array:
    """The bound of `electrical`, with the least loss of `cruise`."""
    friction, drives = prepared.arm.friction_law, prepared.arm.drives
    base = prepared.arm.base_power + float(drives.inverter_constant.sum())
    base -= _KNEE_DEFICIT * friction.knee * float(friction.coulomb.sum())
    rate = base - waiting
    T, below = _best_durations(cruise, rate, t_min, np.maximum(t_max, t_min))
    return np.asarray(rate * T + potential_gain + cruise.distance @ friction.coulomb + cruise.loss(T) - below)


def _best_durations(cruise: _Cruise, rate: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Durations (P,) [s] near those from `low` to `high` (P,) at which `rate` · T and the loss of `cruise` are least
    together, and how far (P,) [J] this least is below their sum there, at most.

    The sum is convex: it stays above its tangent at T on the interval that is known to hold the best duration. The loss
    falls nearly with a power of T. So the secant method finds by logarithms where its fall is `rate`; it goes to the
    middle of the interval instead of out of it.
    """
    T, below = np.where(rate > 0, low, high), np.zeros_like(low)
    fall = -cruise.slope(low)
    # most motions are best as fast as they can be
    slower = np.flatnonzero((rate > 0) & (fall > rate))
    cruise, rate, low, high = cruise.only(slower), rate[slower], np.log(low[slower]), np.log(high[slower])
    x, over = low, np.log(fall[slower] / rate)
    step, missed, done = over / _FALL, np.full_like(x, np.inf), np.zeros(len(x), dtype=bool)
    for _ in range(_POINTS):
        if done.all():
            break
        ahead = np.where((x + step > low) & (x + step < high), x + step, (low + high) / 2)
        ahead = np.where(done, x, ahead)
        duration = np.exp(ahead)
        fall = -cruise.slope(duration)
        with np.errstate(divide="ignore", invalid="ignore"):
            # without a fall, or twice at the same place, there is no step
            there = np.log(fall / rate)
            step = there * (ahead - x) / (over - there)
        low, high = np.where(there > 0, ahead, low), np.where(there > 0, high, ahead)
        x, over, rising = ahead, there, rate - fall
        missed = np.maximum(rising * (duration - np.exp(low)), rising * (duration - np.exp(high)))
        done = missed <= _EXACT * rate * duration
    T[slower], below[slower] = np.exp(x), missed
    return T, below


class _Cruise:
    """The least loss ∫ g(|v|) dt of joints that displacement `distance` (P, nq) under acceleration and jerk limits."""

    def __init__(self, distance: Array, friction: FrictionLaw, limits: Limits) -> None:
        self.distance, self.friction, self.limits, self.a = distance, friction, limits, limits.a_max
        self.jerk_ramp = limits.a_max / limits.j_max
        self.ramp_speed = limits.a_max * self.jerk_ramp / 2

    def only(self, rows: npt.NDArray[np.intp]) -> Self:
        """The same of some of the motions."""
        return type(self)(self.distance[rows], self.friction, self.limits)

    def speed(self, T: Array) -> tuple[Array, Array]:
        """c (P, nq) for durations T (P,), and the jerk ramp's time that it is subject to."""
        T = T[:, None]
        moving, spread = T - self.jerk_ramp, self.distance * (4 / self.a)
        ramps = 4 * self.jerk_ramp * self.ramp_speed / self.a
        with_jerk = self.a / 2 * (moving - np.sqrt(np.maximum(moving * moving + ramps - spread, 0.0)))
        without = self.a / 2 * (T - np.sqrt(np.maximum(T * T - spread, 0.0)))
        ramped = with_jerk > self.ramp_speed
        return np.where(ramped, with_jerk, without), np.where(ramped, self.jerk_ramp, 0.0)

    def slope(self, T: Array) -> Array:
        """Derivative (P,) of the loss by T [W]."""
        c, _ = self.speed(T)
        law = self.friction
        # g - c g'
        square = c * c
        return -np.asarray((square * (law.curved / np.sqrt(square + law.speed**2) + law.viscous)).sum(axis=-1))

    def loss(self, T: Array) -> Array:
        """The loss (P,) [J], by parts: T g(c) - 2 ∫ g' t dh."""
        c, ramp = self.speed(T)
        g, integral = self._g(c)
        to_speed = (c * g - integral) / self.a
        ramping = ramp / 2 * (g - self._g(self.ramp_speed)[0])
        return np.asarray((T[:, None] * g - 2 * (to_speed + ramping)).sum(axis=-1))

    def _g(self, v: Array) -> tuple[Array, Array]:
        """g(v), and ∫_0^v g."""
        law, s, square = self.friction, self.friction.speed, v * v
        bent = np.arcsinh(v / s)
        curved = (square / 2 + s * s / 4) * bent - v * np.sqrt(square + s * s) / 4
        return v * (law.curved * bent + law.viscous * v), law.curved * curved + law.viscous * square * v / 3


class _Even(_Cruise):
    """The least loss without acceleration limits: every joint moves at an even speed."""

    def speed(self, T: Array) -> tuple[Array, Array]:
        """The even speeds (P, nq) for durations T (P,); no jerk ramps."""
        even = self.distance / T[:, None]
        return even, np.zeros_like(even)

    def loss(self, T: Array) -> Array:
        """The loss (P,) [J]."""
        return np.asarray(T * self._g(self.speed(T)[0])[0].sum(axis=-1))
