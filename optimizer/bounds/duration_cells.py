"""The dual bound of one pair of end configurations over all durations.

The plain bound at a fixed duration T (`net_energy.electrical`) is convex in T. It is below a target
only within one interval of durations. The interval is divided into cells. The bound of a cell is
the greater one of the plain bound and the dual bound (`dual_bound`).

The dual bound is built around the pair's own motion, or around a straight motion if the pair has no
motion. Its multipliers are linear in time and nearest to the motor torques (least squares), times a
factor. Two kinds of joints have multipliers: all joints without gravity torque, and the joints with
the greatest copper loss of holding. A share of the plain bound's multiplier of speed is added.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.cruise import TINY
from joulepath.optimizer.bounds.dual_bound import CellBounds, DualBound, multiplier_rates
from joulepath.optimizer.bounds.grid_cells import Spacing
from joulepath.optimizer.bounds.net_energy import copper_multiplier, electrical
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.bounds.pair_bounds import GRID_JOINTS, Effort, PairBounds
from joulepath.optimizer.bounds.path_terms import path_terms
from joulepath.optimizer.bounds.reference import Reference, half_sides
from joulepath.optimizer.bounds.weights import Weights
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.dwell import LinearDwell
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.motion.time_scalings import quintic_spline

Factors = tuple[float, float]
"""Factor of the multipliers, and of κ + μ."""


@dataclass(frozen=True)
class DualSettings:
    """Settings of the dual bound of a pair; any values give a valid bound."""

    line_points: int = 17
    """Number of points of the straight line at which gravity torques are compared."""
    probes: int = 60
    """Number of durations at which the plain bound is compared with the target."""
    most_cells: int = 24
    """Largest number of cells that one cell of durations is divided into."""
    factor_scale: float = 0.53
    """First factor of the multipliers if gravity bends as much as the confinement."""
    factor_power: float = -0.4
    """Power of the ratio of bending to confinement in the first factor, fitted to many trials."""
    least_factor: float = 0.2
    """Least first factor of the multipliers."""
    most_factor: float = 1.0
    """Greatest first factor of the multipliers."""
    starts: tuple[Factors, ...] = ((1.0, 0.85), (0.55, 0.35))
    """First trials: shares of the first factor, each with a factor of κ + μ."""
    factor_step: float = 1.6
    """Ratio by which the factors are first changed in search of better factors."""
    mixing: float = 0.2
    """Share of μ in κ + μ."""
    work_share: float = 0.7
    """Share of the plain bound's multiplier of speed η."""
    weightless: float = 1e-9
    """Greatest change of the gravity torque of a joint that carries no gravity [N·m/rad]."""


DUAL = DualSettings()


class DurationCells:
    """Bounds of one pair in cells of durations, up to a target.

    Waiting for the end of the dwell draws constant - power · T over the durations. If the plain
    bound is above the target everywhere there are no cells.
    """

    def __init__(
        self,
        shared: PairBounds,
        pair: Pair,
        motion: Spline | None,
        dwell: LinearDwell,
        durations: tuple[float, float],
        target: float,
    ) -> None:
        self.shared, self.pair, self.motion, self.dwell = shared, pair, motion, dwell
        self.target = target - float(dwell.constant[0])
        self.power = float(dwell.power[0])
        self.edges, self.values = np.zeros(1), np.zeros(0)
        """Edges of the cells, shape (n + 1,) [s], and their bounds without the wait, (n,) [J]."""
        self.least_outside = np.inf
        """Bound of the durations outside of the cells, without the wait [J]."""
        self._factors: Factors | None = None
        shortest, longest = durations
        probes = np.array([shortest])
        if longest > shortest:
            probes = np.geomspace(shortest, longest, DUAL.probes)
        probes[0], probes[-1] = shortest, longest
        low = np.flatnonzero(self._plain(probes, probes) < self.target)
        if not len(low):
            # the plain bound is convex and may be least between two probes: it bounds itself
            self.least_outside = float(self._plain(probes[:1], probes[-1:])[0])
            return
        ends = probes[[max(low[0] - 1, 0), min(low[-1] + 1, len(probes) - 1)]]
        self.edges, self.values = ends, self._plain(ends[:1], ends[1:])
        self.least_outside = self.target

    @property
    def least(self) -> float:
        """Bound of all durations with the wait, at most the target [J]."""
        least = min(self.values.min(initial=np.inf), self.least_outside, self.target)
        return float(least + self.dwell.constant[0])

    def raise_bounds(self, effort: Effort, deadline: Deadline) -> None:
        """Raise the bounds of cells with some effort, in groups, the lowest cells first.

        The computation ends if a raised cell is the lowest cell, if all cells reach the target, or
        if time is short.
        """
        self._divide(effort.cell_ratio)
        left = self.values < self.target
        while True:
            open_ = np.flatnonzero(left & (self.values <= self.values[~left].min(initial=np.inf)))
            if not len(open_) or deadline.left < effort.time_for(self.shared.chain.nq):
                return
            last = open_[open_ < open_[0] + effort.cells_per_group][-1]
            group = slice(open_[0], last + 1)
            edges = self.edges[group.start : group.stop + 1]
            for value in self._dual_bounds(edges, self.values[group], effort, deadline):
                self.values[group] = np.maximum(self.values[group], value)
            left[group] = False

    def _divide(self, ratio: float) -> None:
        """Divide the cells below the target into cells of a ratio of durations."""
        edges, values = [self.edges[:1]], list[Array]()
        for low, high, value in zip(self.edges[:-1], self.edges[1:], self.values, strict=True):
            count = int(np.ceil(np.log(high / low) / np.log(ratio))) if value < self.target else 1
            count = min(max(count, 1), DUAL.most_cells)
            inner = np.geomspace(low, high, count + 1)
            inner[-1] = high
            edges.append(inner[1:])
            values.append(np.full(count, value))
        self.edges = np.concatenate(edges)
        self.values = np.maximum(
            np.concatenate([*values, np.zeros(0)]), self._plain(self.edges[:-1], self.edges[1:])
        )

    def _plain(self, shortest: Array, longest: Array) -> Array:
        """Plain bounds (n,) [J] over durations from `shortest` to `longest` (n,) [s]."""
        n = len(shortest)
        displacement = np.tile(self._displacement, (n, 1))
        gain, waiting = np.full(n, self._gain), np.full(n, self.power)
        return electrical(self.shared.prepared, displacement, gain, shortest, longest, waiting)

    @property
    def _displacement(self) -> Array:
        return self.pair.q_goal - self.pair.q_start

    @cached_property
    def _gain(self) -> float:
        """Gain of potential energy [J]."""
        prepared, pair = self.shared.prepared, self.pair
        return prepared.potential(pair.q_goal) - prepared.potential(pair.q_start)

    def _dual_bounds(
        self, edges: Array, values: Array, effort: Effort, deadline: Deadline
    ) -> Iterator[Array]:
        """Dual bounds (n,) [J] of cells, with the multipliers of different numbers of joints.

        Args:
            edges: edges of the cells, shape (n + 1,) [s].
            values: bounds so far, shape (n,) [J].
            effort: effort.
            deadline: end of the computation, checked between two numbers of joints.
        """
        middles = np.sqrt(edges[:-1] * edges[1:])
        middle = float(np.sqrt(edges[0] * edges[-1]))
        (x, torque), work = self._path(effort.steps, middle), self._work(middle)
        share = np.linspace(0.0, 1.0, effort.steps + 1)
        linear = np.stack([np.ones_like(share), share], axis=1)
        multipliers = linear @ np.linalg.lstsq(linear, torque, rcond=None)[0]
        worst = float(middles[values.argmin()])
        for kept in self._joints_with_multipliers(effort.loaded_joints):
            dual = self._dual(Reference(x, multipliers * kept), float(edges[-1]), effort.spacing)
            self._factors = self._best_factors(dual, worst, work, effort.weight_rounds)
            value = self._with_factors(dual.over(edges), self._factors, work)
            worst = float(middles[value.argmin()])
            yield value
            if deadline.left < effort.time_for(self.shared.chain.nq):
                return

    def _best_factors(self, dual: DualBound, duration: float, work: float, rounds: int) -> Factors:
        """Factors of nearly the greatest bound for a duration [s], by coordinate search."""
        cell = dual.over(np.full(2, duration))
        first, step = self._first_factor(dual, duration), DUAL.factor_step
        starts = [(first * share, stiffness) for share, stiffness in DUAL.starts]
        if self._factors:
            starts = [self._factors]
        value, best = max((float(self._with_factors(cell, each, work)[0]), each) for each in starts)
        for _ in range(rounds):
            for is_stiffness, factor in product((True, False), (1 / step, step)):
                scale, stiffness = best
                tried = (scale, stiffness * factor) if is_stiffness else (scale * factor, stiffness)
                found = float(self._with_factors(cell, tried, work)[0])
                if found > value:
                    best, value = tried, found
            step = float(np.sqrt(step))
        return best

    def _with_factors(self, cells: CellBounds, factors: Factors, work: float) -> Array:
        """Bounds (n,) [J] of cells with given factors and η = `work`."""
        scale, stiffness = factors[0], factors[1] * self.shared.stiffness
        confined = np.where(self._carries_gravity, (1 - DUAL.mixing) * stiffness, 0.0)
        return cells(Weights(scale, confined, stiffness - confined, work), self.power)

    def _first_factor(self, dual: DualBound, duration: float) -> float:
        """An empirical factor of the multipliers, near the best factor in many trials."""
        grid = list(dual.terms.grid)
        bending = (
            np.abs(dual.terms.omega).mean(axis=0)
            @ self.shared.chain.potential_bound(3)[:, grid, grid]
        )
        confinement = (1 - DUAL.mixing) * self.shared.stiffness[grid] * (np.pi / duration) ** 2
        ratio = float((bending / confinement).max())
        factor = DUAL.factor_scale * max(ratio, TINY) ** DUAL.factor_power
        return float(np.clip(factor, DUAL.least_factor, DUAL.most_factor))

    def _dual(self, reference: Reference, longest: float, spacing: Spacing) -> DualBound:
        shared, arm = self.shared, self.shared.prepared.arm
        half = half_sides(reference, arm.active_limits, longest)
        return DualBound(
            path_terms(shared.chain, reference, shared.loss, half, self._grid, spacing),
            shared.loss,
            multiplier_rates(reference.multipliers, shared.loss, shared.friction.load),
            shared.friction,
            arm.active_limits,
            arm.base_power + float(arm.drives.inverter_constant.sum()),
            self._gain,
            longest,
            shared.chain.rotor,
        )

    @cached_property
    def _carries_gravity(self) -> Mask:
        """Joints (nq,) with a gravity torque."""
        change = self.shared.chain.potential_bound(2).max(axis=1)
        return np.asarray(change > DUAL.weightless)

    def _joints_with_multipliers(self, loaded_joints: tuple[int, ...]) -> list[Mask]:
        """Joints (nq,) without gravity torque, and some joints of the greatest loss of holding."""
        rank = np.argsort(np.argsort(-self._holding_loss, kind="stable"))
        return [~self._carries_gravity | (rank < count) for count in loaded_joints]

    @cached_property
    def _holding_loss(self) -> Array:
        """Mean copper loss (nq,) [W] of the gravity torques along the straight line."""
        pair, shared = self.pair, self.shared
        share = np.linspace(0.0, 1.0, DUAL.line_points)[:, None]
        line = pair.q_start + share * (pair.q_goal - pair.q_start)
        return np.asarray(shared.loss * (shared.chain.gravity_torque(line)[0] ** 2).mean(axis=0))

    @property
    def _grid(self) -> tuple[int, int]:
        order = np.argsort(-self._holding_loss, kind="stable")
        first, other = sorted(order[:GRID_JOINTS].tolist())
        return first, other

    def _work(self, duration: float) -> float:
        """η of `dual_bound`, a share of the η of the plain bound; 0 for load-dependent friction."""
        if self.shared.friction.load is not None:
            return 0.0
        return DUAL.work_share * copper_multiplier(
            self.shared.prepared, self._displacement, self._gain, duration
        )

    def _path(self, steps: int, duration: float) -> tuple[Array, Array]:
        """Positions and motor torques (steps + 1, nq) of the pair's motion in a duration [s]."""
        prepared, pair, spline = self.shared.prepared, self.pair, self.motion
        if spline is None:
            spline = quintic_spline(pair.q_start, pair.q_goal, duration)
        q, v, a = sample(spline, np.linspace(0.0, 1.0, steps + 1) * spline.duration)
        q, faster = np.array(q), spline.duration / duration
        q[0], q[-1] = pair.q_start, pair.q_goal
        return q, prepared.motor_torques(q, faster * v, faster**2 * a)
