"""The dual bound of one pair over every duration that the plain bound does not rule out:
`bounds.dual_bound`.

`lower_bound.electrical` at a fixed duration T is convex in T. Beyond the durations where it reaches
a target it stays above it. In between, cells of T each have the greater of the plain bound and the
dual one, which is built around the pair's own motion, or a straight one if it has none. Its
multipliers are those nearest to the motor torque that are linear in time, of the joints that carry
no gravity and of those that lose most by it, times a factor. With them goes a share of the plain
bound's own multiplier of speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.cruise import TINY, copper_loss
from joulepath.optimizer.bounds.dual_bound import CellBounds, DualBound, multiplier_rates
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.grid_cells import Spacing
from joulepath.optimizer.bounds.lower_bound import copper_multiplier, electrical
from joulepath.optimizer.bounds.path_terms import path_terms
from joulepath.optimizer.bounds.reference import Reference, half_sides
from joulepath.optimizer.bounds.weights import Weights
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.dwell import LinearDwell
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate

# at how many points of the straight line gravity is compared
LINE_POINTS = 17
# at how many durations the plain bound is compared with the target, and into how many cells one is
# divided at most
PROBES, MOST_CELLS = 60, 24
# first factor of the multipliers where gravity bends as much as confinement does, the power of that
# ratio that it has, its least and greatest; and with which shares of it κ + μ has which factors at
# first
SCALE, POWER, LEAST_FACTOR, MOST_FACTOR = 0.53, -0.4, 0.2, 1.0
STARTS = (1.0, 0.85), (0.55, 0.35)
# by how much factors are changed at first to find better ones; share μ of κ + μ, and share of the
# plain η
FACTOR_STEP, MIXING, WORK = 1.6, 0.2, 0.7
# a joint whose gravity torque changes by less than this with any joint carries none [N·m]
WEIGHTLESS = 1e-9
GRID_JOINTS = 2
"""Joints with a grid: those that lose most by holding against gravity."""


@dataclass(frozen=True)
class Effort:
    """How finely a pair is bounded.

    `steps` of the path, ratio `cell` of the durations of a cell, `group` of cells that share their
    boxes, `spacing` of the grid, numbers of `heavy` joints that have multipliers, and `rounds` of
    the search for weights. A group of an arm of six joints takes `time` [s] at most, on a machine
    that does nothing else.
    """

    steps: int
    cell: float
    group: int
    spacing: Spacing
    heavy: tuple[int, ...]
    rounds: int
    time: float

    def takes(self, joints: int) -> float:
        """The time [s] without which a group is not begun.

        There are joints**5 bounds on the third derivatives of the inertia.
        """
        return self.time * max(joints / 6, 1) ** 5


@dataclass(frozen=True)
class PairBounds:
    """What the dual bounds of a problem's pairs share: c [W/(N·m)²] per joint, and κ + μ of a
    stiffness of 1.
    """

    prepared: PreparedProblem
    chain: ChainDerivatives
    friction: FrictionConjugate
    loss: Array
    stiffness: Array

    @classmethod
    def of(cls, prepared: PreparedProblem) -> PairBounds | None:
        """None where the bound does not hold or has nothing to add: another objective, a friction
        law that is not concave or has the same torque at every speed, a single joint."""
        arm = prepared.arm
        friction = FrictionConjugate.of(arm.friction_law, arm.active_limits.v_max)
        if (
            prepared.problem.objective != "electrical"
            or friction is None
            or arm.robot.nq < GRID_JOINTS
        ):
            return None
        stiffness = friction.stiffness(arm.friction_law)
        # friction of the same torque at every speed has no convexity to spare
        if stiffness.min() <= 0:
            return None
        return cls(prepared, ChainDerivatives.of(arm), friction, copper_loss(arm), stiffness)


class DurationCells:
    """One pair's bounds in cells of durations between which waiting draws constant - power · T, up
    to a target [J].

    `edges` (n + 1,) [s] are the cells', `values` (n,) [J] their bounds without the wait. Where the
    plain bound is above the target everywhere there are no cells.
    """

    def __init__(
        self,
        pairs: PairBounds,
        candidate: Candidate,
        dwell: LinearDwell,
        durations: tuple[float, float],
        target: float,
    ) -> None:
        self.pairs, self.candidate, self.dwell = pairs, candidate, dwell
        self.target = target - float(dwell.constant[0])
        self.power = float(dwell.power[0])
        self.edges, self.values, self.least_outside = np.zeros(1), np.zeros(0), np.inf
        self._factors: tuple[float, float] | None = None
        shortest, longest = durations
        probes = (
            np.geomspace(shortest, longest, PROBES) if longest > shortest else np.array([shortest])
        )
        probes[0], probes[-1] = shortest, longest
        low = np.flatnonzero(self._plain(probes, probes) < self.target)
        if not len(low):
            # convex: its least value may lie between two probes, and is the plain bound's own
            self.least_outside = float(self._plain(probes[:1], probes[-1:])[0])
            return
        ends = probes[[max(low[0] - 1, 0), min(low[-1] + 1, len(probes) - 1)]]
        self.edges, self.values, self.least_outside = (
            ends,
            self._plain(ends[:1], ends[1:]),
            self.target,
        )

    @property
    def least(self) -> float:
        """The bound of all durations, wait included, at most the target [J]."""
        least = min(self.values.min(initial=np.inf), self.least_outside, self.target)
        return float(least + self.dwell.constant[0])

    def raise_bounds(self, effort: Effort, deadline: Deadline) -> None:
        """Raise the cells' bounds with some effort, the lowest first, until those left are above
        the least of the others, or time is short."""
        self._divide(effort.cell)
        left = self.values < self.target
        while True:
            open_ = np.flatnonzero(left & (self.values <= self.values[~left].min(initial=np.inf)))
            if not len(open_) or deadline.left < effort.takes(self.pairs.chain.nq):
                return
            group = slice(open_[0], open_[open_ < open_[0] + effort.group][-1] + 1)
            for value in self._bounds(
                self.edges[group.start : group.stop + 1], self.values[group], effort, deadline
            ):
                self.values[group] = np.maximum(self.values[group], value)
            left[group] = False

    def _divide(self, ratio: float) -> None:
        """Divide the cells below the target into those of a ratio of durations."""
        edges, values = [self.edges[:1]], list[Array]()
        for low, high, value in zip(self.edges[:-1], self.edges[1:], self.values, strict=True):
            count = int(np.ceil(np.log(high / low) / np.log(ratio))) if value < self.target else 1
            count = min(max(count, 1), MOST_CELLS)
            inner = np.geomspace(low, high, count + 1)
            inner[-1] = high
            edges.append(inner[1:])
            values.append(np.full(count, value))
        self.edges = np.concatenate(edges)
        self.values = np.maximum(
            np.concatenate([*values, np.zeros(0)]), self._plain(self.edges[:-1], self.edges[1:])
        )

    def _plain(self, shortest: Array, longest: Array) -> Array:
        """The plain bound (n,) [J] for durations between these (n,) [s]."""
        n = len(shortest)
        displacement = np.tile(self.candidate.q_goal - self.candidate.q_start, (n, 1))
        gain, waiting = np.full(n, self._gain), np.full(n, self.power)
        return electrical(self.pairs.prepared, displacement, gain, shortest, longest, waiting)

    @cached_property
    def _gain(self) -> float:
        prepared, candidate = self.pairs.prepared, self.candidate
        return prepared.potential(candidate.q_goal) - prepared.potential(candidate.q_start)

    def _bounds(
        self, edges: Array, values: Array, effort: Effort, deadline: Deadline
    ) -> Iterator[Array]:
        """Dual bounds (n,) [J] of cells between these edges (n + 1,) [s], whose bounds are `values`
        (n,) [J] so far, with the multipliers of more and more joints."""
        middles = np.sqrt(edges[:-1] * edges[1:])
        middle = float(np.sqrt(edges[0] * edges[-1]))
        (x, torque), work = self._motion(effort.steps, middle), self._work(middle)
        share = np.linspace(0.0, 1.0, effort.steps + 1)
        linear = np.stack([np.ones_like(share), share], axis=1)
        multipliers = linear @ np.linalg.lstsq(linear, torque, rcond=None)[0]
        worst = float(middles[values.argmin()])
        for kept in self._kept(effort.heavy):
            dual = self._dual(Reference(x, multipliers * kept), float(edges[-1]), effort.spacing)
            self._factors = self._best_factors(dual, worst, work, effort.rounds)
            value = self._with_factors(dual.over(edges), self._factors, work)
            worst = float(middles[value.argmin()])
            yield value
            if deadline.left < effort.takes(self.pairs.chain.nq):
                return

    def _best_factors(
        self, dual: DualBound, duration: float, work: float, rounds: int
    ) -> tuple[float, float]:
        """Factors of the multipliers and of κ + μ near which the bound for a duration is
        greatest."""
        cell, first, step = (
            dual.over(np.full(2, duration)),
            self._first_factor(dual, duration),
            FACTOR_STEP,
        )
        starts = (
            [self._factors]
            if self._factors
            else [(first * share, stiffness) for share, stiffness in STARTS]
        )
        value, best = max((float(self._with_factors(cell, each, work)[0]), each) for each in starts)
        for _ in range(rounds):
            for stiffer, factor in product((True, False), (1 / step, step)):
                scale, stiffness = best
                tried = (scale, stiffness * factor) if stiffer else (scale * factor, stiffness)
                found = float(self._with_factors(cell, tried, work)[0])
                if found > value:
                    best, value = tried, found
            step = float(np.sqrt(step))
        return best

    def _with_factors(self, cells: CellBounds, factors: tuple[float, float], work: float) -> Array:
        """The bounds of cells with these factors, and η."""
        scale, stiffness = factors[0], factors[1] * self.pairs.stiffness
        confined = np.where(self._carries, (1 - MIXING) * stiffness, 0.0)
        return cells(Weights(scale, confined, stiffness - confined, work), self.power)

    def _first_factor(self, dual: DualBound, duration: float) -> float:
        """A factor of the multipliers that is near the best one in many trials."""
        grid = list(dual.terms.grid)
        bending = (
            np.abs(dual.terms.omega).mean(axis=0)
            @ self.pairs.chain.potential_bound(3)[:, grid, grid]
        )
        confinement = (1 - MIXING) * self.pairs.stiffness[grid] * (np.pi / duration) ** 2
        ratio = float((bending / confinement).max())
        return float(np.clip(SCALE * max(ratio, TINY) ** POWER, LEAST_FACTOR, MOST_FACTOR))

    def _dual(self, reference: Reference, longest: float, spacing: Spacing) -> DualBound:
        pairs, arm = self.pairs, self.pairs.prepared.arm
        half = half_sides(reference, arm.active_limits, longest)
        return DualBound(
            path_terms(pairs.chain, reference, pairs.loss, half, self._grid, spacing),
            pairs.loss,
            multiplier_rates(reference.multipliers, pairs.loss, pairs.friction.load),
            pairs.friction,
            arm.active_limits,
            arm.base_power + float(arm.drives.inverter_constant.sum()),
            self._gain,
            longest,
            pairs.chain.rotor,
        )

    @cached_property
    def _carries(self) -> Mask:
        """The joints (nq,) that carry gravity."""
        return np.asarray(self.pairs.chain.potential_bound(2).max(axis=1) > WEIGHTLESS)

    def _kept(self, heavy: tuple[int, ...]) -> list[Mask]:
        """The joints (nq,) that have multipliers: those that carry no gravity, and some of those
        that lose most.
        """
        rank = np.argsort(np.argsort(-self._hold, kind="stable"))
        return [~self._carries | (rank < count) for count in heavy]

    @cached_property
    def _hold(self) -> Array:
        """Mean copper loss (nq,) [W] of each joint's gravity torque on the straight line."""
        candidate, pairs = self.candidate, self.pairs
        share = np.linspace(0.0, 1.0, LINE_POINTS)[:, None]
        line = candidate.q_start + share * (candidate.q_goal - candidate.q_start)
        return np.asarray(pairs.loss * (pairs.chain.gravity_torque(line)[0] ** 2).mean(axis=0))

    @property
    def _grid(self) -> tuple[int, int]:
        first, other = sorted(np.argsort(-self._hold, kind="stable")[:GRID_JOINTS].tolist())
        return first, other

    def _work(self, duration: float) -> float:
        """η of the dual bound; see its text."""
        if self.pairs.friction.load is not None:
            return 0.0
        displacement = self.candidate.q_goal - self.candidate.q_start
        return WORK * copper_multiplier(self.pairs.prepared, displacement, self._gain, duration)

    def _motion(self, steps: int, duration: float) -> tuple[Array, Array]:
        """Positions and motor torques (steps + 1, nq) of the pair's motion in this duration, or of
        a straight one.
        """
        prepared, candidate = self.pairs.prepared, self.candidate
        if candidate.attempt is not None and candidate.attempt.spline is not None:
            spline = candidate.attempt.spline
        else:
            spline = quintic_spline(candidate.q_start, candidate.q_goal, duration)
        q, v, a = sample(spline, np.linspace(0.0, 1.0, steps + 1) * spline.duration)
        q, faster = np.array(q), spline.duration / duration
        q[0], q[-1] = candidate.q_start, candidate.q_goal
        return q, prepared.motor_torques(q, faster * v, faster**2 * a)
