"""Lower bounds on the objective of all motions, of any shape and any allowed duration, between two
configurations.

Each term below is proven in its function's docstring; their sum is minimised over the duration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.cruise import TINY, Cruise, EvenTravel, copper_loss
from joulepath.optimizer.dynamics.dwell import holding_power, linear_dwells
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import DURATIONS

# max over x ≥ 0 of x - x² / sqrt(x² + 1), rounded up: what spreading Coulomb friction's jump takes
# from |v|, in knees
_KNEE_DEFICIT = 0.3003
# duration of a part of a motion [s] that stands for none
SHORTEST_PART = 1e-12
# points of the secant method for the best duration at most; how steep it takes the loss to fall
# with the duration at first; and the share of its cost to which a duration is the best one
_POINTS, _FALL, _EXACT = 12, 1.7, 1e-9


def lower_bounds(
    prepared: PreparedProblem, displacement: Array, potential_gain: Array, hold: Array | None = None
) -> tuple[Array, Array]:
    """Bounds (P,) on the problem's objective [J] and least durations (P,) [s] for candidates.

    displacement (P, nq) [rad] is goal - start, potential_gain (P,) [J] the gain of potential
    energy, `hold` (P,) [W] the power that holding the goal draws, needed for a problem with a
    dwell. A candidate whose least duration exceeds the longest allowed one has the bound inf. Along
    a tool path no motion is shorter than the path leaves it time for (`kinematics.least_time`).

    Waiting draws constant - power · T on each of its linear pieces (see
    `joulepath.optimizer.dynamics.dwell`): there it is a constant and a power less for every second of
    the motion, and the least over the pieces is a bound for all durations.
    """  # noqa: E501
    problem = prepared.problem
    shortest = np.maximum(
        shortest_duration(displacement, problem.arm.active_limits), DURATIONS.least
    )
    most = DURATIONS.longest if problem.duration_max is None else problem.duration_max
    t_min = np.maximum(shortest, max(problem.duration_min or 0.0, min(prepared.least_time, most)))
    t_max = np.full_like(t_min, most)
    if problem.objective == "mechanical":
        bound = mechanical(potential_gain)
    elif problem.dwell is None or hold is None:
        bound = _least_drawn(
            prepared, displacement, potential_gain, t_min, t_max, np.zeros_like(potential_gain)
        )
    else:
        bound = np.full_like(potential_gain, np.inf)
        for piece in linear_dwells(problem.dwell, problem.arm, hold):
            low, high = np.maximum(t_min, piece.t_min), np.minimum(t_max, piece.t_max)
            value = piece.constant + _least_drawn(
                prepared, displacement, potential_gain, low, high, piece.power
            )
            bound = np.where(low <= high, np.minimum(bound, value), bound)
    return np.where(t_min > t_max, np.inf, bound), shortest


def priced_bounds(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    price: float,
    longest: float,
) -> Array:
    """Bounds (P,) [J] on energy + price · duration of motions that last at most `longest` [s]; inf
    for those that last longer in any case.

    displacement (P, nq) [rad] and potential_gain (P,) [J] as in `lower_bounds`; `price` [W] of time
    may be negative.
    """
    shortest = np.maximum(
        shortest_duration(displacement, prepared.arm.active_limits), DURATIONS.least
    )
    t_max, waiting = np.full_like(shortest, longest), np.full_like(shortest, -price)
    t_min = np.maximum(shortest, min(prepared.least_time, longest))
    bound = _least_drawn(prepared, displacement, potential_gain, t_min, t_max, waiting)
    return np.where(shortest > longest, np.inf, bound)


def travel_bounds(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    price: float = 0.0,
    longest: float = DURATIONS.longest,
) -> Array:
    """Bounds (P,) [J] on energy + price · duration of parts of a motion that may begin and end at
    any speed.

    displacement (P, nq) [rad] and potential_gain (P,) [J] are those of the parts; `price` [W] of
    time, no part longer than `longest` [s]. What a part draws may be less than its bound, by the
    kinetic energy that it begins with. But the sum over the parts of a motion from rest to rest is
    a bound on this motion: its kinetic energy adds up to zero, and ∫ P_net dt is bounded as in
    `electrical`, with four changes. A joint may have any speed at once, so the share of friction
    that grows with speed is at least that of even speed, T g(|displacement| / T), as g is convex
    (Jensen). The least duration is that of the speed limits alone. The bound by the drawn power,
    which is never negative, is left out: it holds for each part, but the greater of the two bounds
    in each part does not, since a part may draw less for what another one has put into speed. And
    so is copper loss, η = 0: what bounds it is the work put into a part.
    """
    distance = np.abs(displacement)
    t_min = np.maximum((distance / prepared.arm.active_limits.v_max).max(axis=-1), SHORTEST_PART)
    cruise = EvenTravel(distance, prepared.arm)
    net = NetEnergy.of(prepared.arm, cruise, potential_gain, np.full_like(t_min, -price), most=0.0)
    bound = net.least(t_min, np.full_like(t_min, longest))
    return np.where(t_min > longest, np.inf, bound)


@dataclass(frozen=True)
class LeastBound:
    """`lower_bounds` of a problem for motions of which only the least displacement and potential
    gain are known.
    """

    prepared: PreparedProblem

    def of(self, displacement: Array, potential_gain: Array) -> Array:
        """Bounds (b,) [J] for joint displacements (b, nq) [rad] and gains of potential energy (b,)
        [J], or more.
        """
        if self.prepared.problem.objective == "mechanical":
            potential_gain = np.maximum(
                potential_gain, 0.0
            )  # that bound is |gain|, of which zero is the least
        return lower_bounds(
            self.prepared, displacement, potential_gain, np.full_like(potential_gain, self._hold)
        )[0]

    def of_other_turns(self, displacement: Array, turned: Array, potential_gain: Array) -> Array:
        """Bounds (b,) [J] on motions of which at least one joint has the displacement `turned` (b,
        nq) [rad] or more, inf for none, and the others as in `of`."""
        b, nq = displacement.shape
        other = np.where(np.eye(nq, dtype=bool), turned[:, None], displacement[:, None]).reshape(
            -1, nq
        )
        there, value = np.isfinite(other).all(axis=1), np.full(b * nq, np.inf)
        if there.any():
            value[there] = self.of(other[there], np.repeat(potential_gain, nq)[there])
        return np.asarray(value.reshape(b, nq).min(axis=1))

    @cached_property
    def _hold(self) -> float:
        """Least power [W] to stand still: with no torque to hold."""
        return float(holding_power(self.prepared.arm, np.zeros(self.prepared.arm.robot.nq)))


def mechanical(potential_gain: Array) -> Array:
    """Bound on ∫ Σ |tau_j v_j| dt [J]: it is at least |∫ tau · v dt|, the change of energy between
    two rests.
    """
    return np.abs(potential_gain)


def _least_drawn(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    t_min: Array,
    t_max: Array,
    waiting: Array,
) -> Array:
    """The greater of `electrical` and the energy drawn by a motion without any work.

    If the supply takes nothing back and there is no energy storage, the drawn power is never
    negative. On an isolated bus it is never less than that of the electronics, because they cannot
    use the joints' surplus.
    """
    arm = prepared.arm
    bound = electrical(prepared, displacement, potential_gain, t_min, t_max, waiting)
    if arm.regeneration > 0 or arm.bus.mode == "storage":
        return bound
    rate = (arm.base_power if arm.bus.mode == "isolated" else 0.0) - waiting
    return np.maximum(bound, np.minimum(rate * t_min, rate * np.maximum(t_max, t_min)))


def electrical(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    t_min: Array,
    t_max: Array,
    waiting: Array,
) -> Array:
    """Bound on the electrical energy [J] of motions with the given joint displacement (P, nq) and
    potential_gain (P,) [J].

    `waiting` (P,) [W] is what a motion saves by every second that it takes: nothing without a
    dwell.

    Energy ≥ ∫ P_net dt = base · T + potential_gain + friction + copper + inverter on every bus:

    - shared: drawn = max(P_net, 0) ≥ P_net. With a share below 1 given back, max(P_net, 0) - share
      · max(-P_net, 0) =
      P_net + (1 - share) max(-P_net, 0) ≥ P_net. So too for a recuperating bus, whose share is its
      efficiency.
    - isolated: drawn = base + Σ max(P_j, 0) ≥ base + Σ P_j = P_net.
    - storage: with c charged of the net surplus s, total = ∫ (max(P_net, 0) - efficiency · c -
      share · (s - c)) dt (see
      `energy.bus_flow`) ≥ ∫ P_net dt, as c ≤ s and neither factor exceeds 1. The charge's fall is
      in the total, so the
      bound holds whatever the store begins with.

    Friction that grows with the load loses v · tau_f(v) of an unloaded joint, or more: its share in
    that is left out.

    copper: with c = (copper + quadratic inverter loss) / torque_constant² [W/(N·m)²] of each joint
    and any η ≥ 0, c (tau + tau_f)² ≥ 2 η v (tau + tau_f) - η² v² / c, the square of a difference. η
    is the same for all joints, and Σ v (tau + tau_f) is the rate of kinetic and potential energy
    plus friction. So copper and quadratic inverter loss are at least 2 η (potential_gain +
    friction) - η² Σ ∫ v² / c dt. What holding against gravity takes beyond that is left out, and so
    is the inverter's loss beyond its constant and its square.

    friction: v · tau_f(v) ≥ coulomb |v| + g(|v|) - deficit with g(v) = v (curved asinh(v / speed) +
    viscous v) convex. The Coulomb part is at least coulomb · |displacement|. For the rest, let m(h)
    be how long |v| exceeds h: ∫ g dt = ∫ g'(h) m(h) dh, ∫ m(h) dh ≥ |displacement|, and m(h) ≤ T -
    2 t(h), where t(h) ≥ h / a_max (and half a jerk ramp more above half its speed) is the least
    time from rest to speed h and back. As g' grows, the least integral fills m up to its limit from
    h = 0 on, until the displacement is reached at h = c:

        |displacement| = ∫_0^c (T - 2 t(h)) dh,      ∫ g dt ≥ ∫_0^c g'(h) (T - 2 t(h)) dh.

    This is the value of a linear program whose right-hand side is linear in T, so it is convex in
    T, with slope g(c) - c g'(c). So is it of (1 + 2 η) g(v) - η² v² / c in the place of g, as long
    as that is convex up to the greatest speed: η is no greater. For each T the bound is a parabola
    in η, and its greatest value is known. The greatest of convex functions is convex:
    `NetEnergy.least` finds the least over [t_min, t_max].
    """
    return NetEnergy.for_motions(prepared.arm, displacement, potential_gain, waiting).least(
        t_min, t_max
    )


def copper_multiplier(
    prepared: PreparedProblem, displacement: Array, potential_gain: float, duration: float
) -> float:
    """The η of `electrical` with which the bound on motions of one displacement (nq,) [rad] and
    duration [s] is greatest."""
    net = NetEnergy.for_motions(prepared.arm, displacement[None], np.array([potential_gain]))
    return float(net.multiplier(np.array([duration]))[0])


@dataclass(frozen=True)
class NetEnergy:
    """The bound of `electrical` over the duration T, with the least losses of `cruise`, for P
    pairs: `power` (P,) [W] that is drawn at all times, and `work` (P,) [J], the gain with the
    Coulomb loss, less `deficit` [W] times T; η up to `most`."""

    cruise: Cruise
    power: Array
    work: Array
    deficit: float
    most: float

    @staticmethod
    def of(
        arm: Arm, cruise: Cruise, potential_gain: Array, waiting: Array, most: float
    ) -> NetEnergy:
        """The bound of an arm; `potential_gain` and `waiting` (P,) as of `electrical`."""
        law = arm.friction_law
        power = arm.base_power + float(arm.drives.inverter_constant.sum()) - waiting
        deficit = _KNEE_DEFICIT * law.knee * float(law.coulomb.sum())
        return NetEnergy(
            cruise, power, potential_gain + cruise.distance @ law.coulomb, deficit, most
        )

    @staticmethod
    def for_motions(
        arm: Arm, displacement: Array, gain: Array, waiting: Array | float = 0.0
    ) -> NetEnergy:
        """The bound of `electrical` for displacements (P, nq) [rad] and gains of potential energy
        (P,) [J].
        """
        return NetEnergy.of(
            arm,
            Cruise(np.abs(displacement), arm),
            gain,
            waiting + np.zeros(len(gain)),
            _most_copper(arm),
        )

    def __getitem__(self, k: NDArray[np.intp]) -> NetEnergy:
        return replace(self, cruise=self.cruise[k], power=self.power[k], work=self.work[k])

    def at(self, T: Array) -> tuple[Array, Array]:
        """The bound (P,) [J] for durations T (P,), and its derivative [W]."""
        friction, friction_slope, square, square_slope = self.cruise.losses(T)
        work = self.work + friction - self.deficit * T
        eta = self._best(work, square)
        more, squared = 1 + 2 * eta, eta * eta
        slope = self.power + more * (friction_slope - self.deficit) - squared * square_slope
        return self.power * T + more * work - squared * square, slope

    def multiplier(self, T: Array) -> Array:
        """η (P,) with which the bound for durations T (P,) is greatest."""
        friction, _, square, _ = self.cruise.losses(T)
        return self._best(self.work + friction - self.deficit * T, square)

    def _best(self, work: Array, square: Array) -> Array:
        return np.clip(work / np.maximum(square, TINY), 0.0, self.most)

    def least(self, t_min: Array, t_max: Array) -> Array:
        """The least bound (P,) [J] over durations from t_min to t_max (P,) [s], or for t_min if
        that is greater.
        """
        rate, longest = self.power - self.deficit, np.maximum(t_min, t_max)
        value, slope = self.at(np.where(rate > 0, t_min, longest))
        # most motions are best as fast as they can be
        slower = np.flatnonzero((rate > 0) & (slope < 0) & (t_min < longest))
        if len(slower):
            value[slower] = self[slower]._least_beyond(
                t_min[slower], slope[slower], longest[slower]
            )
        return value

    def _least_beyond(self, low: Array, slope: Array, high: Array) -> Array:
        """The least bound (P,) [J] over durations from `low` to `high` (P,) [s]; it falls with
        `slope` [W] at `low`.

        It is convex: it stays above its tangent on the interval that is known to hold the best
        duration. The loss falls nearly with a power of the duration. So the secant method finds by
        logarithms where it falls as fast as the power adds up; it goes to the middle of the
        interval instead of out of it.
        """
        rate, low, high = self.power - self.deficit, np.log(low), np.log(high)
        x, over, value, missed = (
            low,
            np.log(1 - slope / rate),
            np.zeros_like(low),
            np.full_like(low, np.inf),
        )
        step, done = over / _FALL, np.zeros(len(x), dtype=bool)
        for _ in range(_POINTS):
            if done.all():
                break
            ahead = np.where((x + step > low) & (x + step < high), x + step, (low + high) / 2)
            ahead = np.where(done, x, ahead)
            T = np.exp(ahead)
            value, slope = self.at(T)
            with np.errstate(divide="ignore", invalid="ignore"):
                # without a fall, or twice at the same place, there is no step
                there = np.log(1 - slope / rate)
                step = there * (ahead - x) / (over - there)
            low, high = np.where(slope < 0, ahead, low), np.where(slope < 0, high, ahead)
            x, over = ahead, there
            missed = np.maximum(slope * (T - np.exp(low)), slope * (T - np.exp(high)))
            done = missed <= _EXACT * rate * T
        return value - missed


def _most_copper(arm: Arm) -> float:
    """The greatest η of `electrical`; 0 for a friction law with a negative coefficient.

    The second derivative of g is least at the greatest speed, and (1 + 2 η) that much less 2 η² / c
    is not below zero.
    """
    law, v, c = arm.friction_law, arm.active_limits.v_max, copper_loss(arm)
    if min(law.coulomb.min(), law.curved.min(), law.viscous.min()) < 0:
        return 0.0
    bent = law.curved * (v**2 + 2 * law.speed**2) / np.hypot(v, law.speed) ** 3 + 2 * law.viscous
    return float((c * bent + np.sqrt(c * bent * (c * bent + 2))).min()) / 2
