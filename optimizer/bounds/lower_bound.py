"""Lower bounds on the objective of all motions between two configurations.

They hold for motions of any shape and of any allowed duration. The electrical bound is proven in
`net_energy`, the mechanical one in `mechanical_bound`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.cruise import EvenTravel
from joulepath.optimizer.bounds.net_energy import NetEnergy, electrical
from joulepath.optimizer.dynamics.dwell import holding_power, linear_dwells
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS

LEAST_PART_DURATION = 1e-12
"""Least duration of a part of a motion [s], which avoids a division by zero."""


def lower_bounds(
    prepared: PreparedProblem, displacement: Array, potential_gain: Array, hold: Array | None = None
) -> tuple[Array, Array]:
    """Lower bounds on a problem's objective, and least durations, for pairs of configurations.

    A pair whose least duration exceeds the longest allowed duration has the bound inf. Along a tool
    path, the path sets a least duration too (`kinematics.tool_path`). The wait for the end of a
    dwell draws constant - power · T on each of its linear pieces (`dynamics.dwell`): a constant,
    and a power less for every second of the motion. The least bound over the pieces is a bound for
    all durations.

    Args:
        prepared: problem of the motions.
        displacement: goal - start, shape (P, nq) [rad].
        potential_gain: gains of potential energy, shape (P,) [J].
        hold: power drawn to hold the goal, shape (P,) [W]; required if the problem has a dwell.

    Returns:
        Bounds (P,) [J] and least durations (P,) [s].
    """
    problem = prepared.problem
    shortest = np.maximum(
        shortest_duration(displacement, problem.arm.active_limits), DURATIONS.least
    )
    longest = DURATIONS.longest if problem.duration_max is None else problem.duration_max
    least = max(problem.duration_min or 0.0, min(prepared.least_time, longest))
    t_min = np.maximum(shortest, least)
    t_max = np.full_like(t_min, longest)
    if problem.objective == "mechanical":
        bound = mechanical(potential_gain)
    elif problem.dwell is None or hold is None:
        bound = _electrical_drawn(
            prepared, displacement, potential_gain, t_min, t_max, np.zeros_like(potential_gain)
        )
    else:
        bound = np.full_like(potential_gain, np.inf)
        for piece in linear_dwells(problem.dwell, problem.arm, hold):
            low, high = np.maximum(t_min, piece.t_min), np.minimum(t_max, piece.t_max)
            value = piece.constant + _electrical_drawn(
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
    """Lower bounds on energy + price · duration.

    Args:
        prepared: problem of the motions.
        displacement: goal - start, shape (P, nq) [rad].
        potential_gain: gains of potential energy, shape (P,) [J].
        price: price of time [W]; may be negative.
        longest: longest duration [s].

    Returns:
        Bounds, shape (P,) [J]; inf for a motion that always takes longer.
    """
    shortest = np.maximum(
        shortest_duration(displacement, prepared.arm.active_limits), DURATIONS.least
    )
    t_max, waiting = np.full_like(shortest, longest), np.full_like(shortest, -price)
    t_min = np.maximum(shortest, min(prepared.least_time, longest))
    bound = _electrical_drawn(prepared, displacement, potential_gain, t_min, t_max, waiting)
    return np.where(shortest > longest, np.inf, bound)


def travel_bounds(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    price: float = 0.0,
    longest: float = DURATIONS.longest,
) -> Array:
    """Lower bounds on energy + price · duration of parts of a motion, whose sum bounds the motion.

    A part begins and ends at any speed. It may draw less than its bound, by its initial kinetic
    energy. But the kinetic energies of all parts of a motion from rest to rest add up to zero, and
    ∫ P_net dt is bounded as in `net_energy.electrical`, with four changes:

    - A joint may have any speed at once, so friction that grows with speed is at least that of even
      speed, T g(|displacement| / T), because g is convex (Jensen).
    - The least duration is that of the speed limits alone.
    - The bound by drawn power, which is never negative, is left out. It holds for each part, but
      the sum of the greater bounds of each part is no bound: a part may draw less because another
      part has paid for its speed.
    - Copper loss is left out, η = 0: its bound depends on the work done within a part.

    Args:
        prepared: problem of the motions.
        displacement: joint displacements of the parts, shape (P, nq) [rad].
        potential_gain: gains of potential energy of the parts, shape (P,) [J].
        price: price of time [W].
        longest: longest duration of a part [s].

    Returns:
        Bounds, shape (P,) [J]; inf for a part that always takes longer.
    """
    distance = np.abs(displacement)
    fastest = (distance / prepared.arm.active_limits.v_max).max(axis=-1)
    t_min = np.maximum(fastest, LEAST_PART_DURATION)
    cruise = EvenTravel(distance, prepared.arm)
    net = NetEnergy.of(prepared.arm, cruise, potential_gain, np.full_like(t_min, -price), most=0.0)
    bound = net.least(t_min, np.full_like(t_min, longest))
    return np.where(t_min > longest, np.inf, bound)


def bound_through_passes(prepared: PreparedProblem, q_start: Array, q_goal: Array) -> float:
    """Lower bound on the objective of all motions through the passes of a problem [J].

    It is -inf where no such bound is known: for mechanical work and with a dwell.

    Args:
        prepared: problem of the motions.
        q_start: start configuration, shape (nq,) [rad].
        q_goal: goal configuration, shape (nq,) [rad].
    """
    problem = prepared.problem
    if problem.objective == "mechanical" or problem.dwell is not None:
        return -np.inf
    q = np.array([q_start, *problem.passes, q_goal])
    gains = np.diff([prepared.potential(each) for each in q])
    longest = DURATIONS.longest if problem.duration_max is None else problem.duration_max
    return float(travel_bounds(prepared, np.diff(q, axis=0), gains, longest=longest).sum())


@dataclass(frozen=True)
class LeastBound:
    """`lower_bounds` of a problem from least displacements and least potential gains alone."""

    prepared: PreparedProblem

    def of(self, displacement: Array, potential_gain: Array) -> Array:
        """Bounds (b,) [J] on motions of at least these displacements (b, nq) [rad] and gains (b,).

        Args:
            displacement: least displacement of each joint, shape (b, nq) [rad].
            potential_gain: least gains of potential energy, shape (b,) [J].
        """
        if self.prepared.problem.objective == "mechanical":
            # the mechanical bound is |gain|, least at a gain of zero
            potential_gain = np.maximum(potential_gain, 0.0)
        return lower_bounds(
            self.prepared, displacement, potential_gain, np.full_like(potential_gain, self._hold)
        )[0]

    def of_other_turns(self, displacement: Array, turned: Array, potential_gain: Array) -> Array:
        """Bounds (b,) [J] on motions of which at least one joint makes another full turn.

        Args:
            displacement: least displacement of each joint, shape (b, nq) [rad].
            turned: least displacement of each joint with another full turn, shape (b, nq) [rad];
                inf if there is none.
            potential_gain: least gains of potential energy, shape (b,) [J].
        """
        b, nq = displacement.shape
        other = np.where(np.eye(nq, dtype=bool), turned[:, None], displacement[:, None]).reshape(
            -1, nq
        )
        exists, value = np.isfinite(other).all(axis=1), np.full(b * nq, np.inf)
        if exists.any():
            value[exists] = self.of(other[exists], np.repeat(potential_gain, nq)[exists])
        return np.asarray(value.reshape(b, nq).min(axis=1))

    @cached_property
    def _hold(self) -> float:
        """Least power [W] to stand still: without torque."""
        return float(holding_power(self.prepared.arm, np.zeros(self.prepared.arm.robot.nq)))


def mechanical(potential_gain: Array) -> Array:
    """Bound on ∫ Σ |tau_j v_j| dt [J]: at least |∫ tau · v dt|, the gain between two rests."""
    return np.abs(potential_gain)


def _electrical_drawn(
    prepared: PreparedProblem,
    displacement: Array,
    potential_gain: Array,
    t_min: Array,
    t_max: Array,
    waiting: Array,
) -> Array:
    """The greater of `electrical` and the energy drawn by a motion without any work.

    If the supply takes nothing back and there is no energy storage, the drawn power is never
    negative. On an isolated bus it is at least that of the electronics, which cannot use the
    surplus of the joints. The arguments are those of `electrical`.
    """
    arm = prepared.arm
    bound = electrical(prepared, displacement, potential_gain, t_min, t_max, waiting)
    if arm.regeneration > 0 or arm.bus.mode == "storage":
        return bound
    rate = (arm.base_power if arm.bus.mode == "isolated" else 0.0) - waiting
    return np.maximum(bound, np.minimum(rate * t_min, rate * np.maximum(t_max, t_min)))
