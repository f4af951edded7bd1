"""The tight lower bound of a pair: `bounds.dual_bound` over every duration that the plain bound does not rule out.

`lower_bound.electrical` at a fixed duration T is convex in T. Beyond the durations where it reaches the energy E* of
the best motion found it stays above E*. In between, cells of T each have the greater of the plain bound and the dual
one. No motion of the pair spends less than the least over the cells, or than E* if that is less: the tight bound is
the lesser of the two, and never below the plain one; nor above the plain one of full turns that no candidate has
(`turns_left_out`). Where the dual bound does not apply (another objective, a friction law that is not concave, more
durations than its cells can cover) the plain one stays.

The dual bound is tried around the pair's own motion, or a straight one if it has none, with a few multipliers: those
nearest to the motor torque that are linear in time, of the joints that carry no gravity, and of these and the joints
that lose most by it. With them goes a share of the plain bound's own multiplier of speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from models.robot import Array
from optimizer.bounds.chain_derivatives import ChainDerivatives
from optimizer.bounds.dual_bound import DualBound, Weights, multiplier_rates
from optimizer.bounds.friction_conjugate import FrictionConjugate
from optimizer.bounds.path_terms import path_terms
from optimizer.bounds.reference import Reference, half_sides
from optimizer.deadline import NEVER, Deadline
from optimizer.energy.dwell import LinearDwell, linear_dwells
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION
from optimizer.search.candidates import Candidate
from optimizer.search.cruise import copper_loss
from optimizer.search.lower_bound import copper_multiplier, electrical
from optimizer.search.turns_left_out import bound_of_turns_left_out
from optimizer.trajectories.spline import sample
from optimizer.trajectories.time_scalings import quintic_spline

# steps of the path; ratio of the durations of a cell, cells that share their boxes, and the greatest ratio of all cells
STEPS, CELL, GROUP, WINDOW = 64, 1.02, 2, 4.0
# durations at which the plain bound is compared with the best energy
PROBES = 400
# multipliers' factors, and κ + μ in units of the friction's stiffness, of which μ is a share; the share of the plain η
SCALES, STIFFNESSES, MIXING, WORK = (0.25, 0.5, 0.8), (0.7, 1.0, 1.4), 0.2, 0.7
# the terms along a path take less than this [s], and so does a bound from them: none is begun with less left
TERMS_TIME, BOUND_TIME = 1.5, 0.2
# a joint whose gravity torque changes by less than this with any joint carries none [N·m]
WEIGHTLESS = 1e-9
# joints with a grid, and at most so many with gravity that have multipliers: those that lose most by it
GRID_JOINTS = HEAVY = 2


def tighten(prepared: PreparedProblem, candidates: list[Candidate], energy: float, deadline: Deadline) -> None:
    """Raise the lower bounds of candidates that lie below `energy` [J], that of a motion, lowest first, in time."""
    if prepared.problem.objective != "electrical":
        return
    pairs = _Pairs.of(prepared)
    if pairs is None:
        return
    below = [each for each in candidates if each.lower_bound < energy and each.goal.tolerance is None]
    for candidate in sorted(below, key=lambda each: each.lower_bound):
        if deadline.left < TERMS_TIME:
            return
        most = bound_of_turns_left_out(prepared, candidate)
        candidate.lower_bound = max(candidate.lower_bound, min(pairs.bound(candidate, energy, deadline), most))


@dataclass(frozen=True)
class _Pairs:
    """What the dual bounds of a problem's pairs share: c [W/(N·m)²] per joint, and κ + μ of a stiffness of 1."""

    prepared: PreparedProblem
    chain: ChainDerivatives
    friction: FrictionConjugate
    loss: Array
    stiffness: Array

    @classmethod
    def of(cls, prepared: PreparedProblem) -> _Pairs | None:
        arm = prepared.arm
        friction = FrictionConjugate.of(arm.friction_law, arm.active_limits.v_max)
        if friction is None or arm.robot.nq < GRID_JOINTS:
            return None
        stiffness = friction.stiffness(arm.friction_law)
        # friction of the same torque at every speed has no convexity to spare
        if stiffness.min() <= 0:
            return None
        return cls(prepared, ChainDerivatives.of(arm), friction, copper_loss(arm), stiffness)

    def bound(self, candidate: Candidate, energy: float, deadline: Deadline) -> float:
        """A bound [J] on the pair's motions, at most `energy`; -inf where the dual bound does not apply."""
        shortest = max(candidate.shortest, LEAST_DURATION, self.prepared.problem.duration_min or 0.0)
        longest = self.prepared.problem.duration_max or LONGEST_DURATION
        best = energy
        for piece in self._waiting(candidate):
            low, high = max(shortest, piece.t_min), min(longest, piece.t_max)
            if low <= high:
                value = _Piece(self, candidate, piece, energy).bound(low, high, deadline)
                best = min(best, value)
        return best

    def _waiting(self, candidate: Candidate) -> list[LinearDwell]:
        """The durations over which waiting for the cycle's end is linear."""
        cycle = self.prepared.problem.cycle
        if cycle is None:
            return [LinearDwell(0.0, np.inf, np.zeros(1), np.zeros(1))]
        return linear_dwells(cycle, self.prepared.arm, self.prepared.holding_power(candidate.q_goal[None]))


@dataclass(frozen=True)
class _Choice:
    """The joints (nq,) whose multipliers are kept, and the weights."""

    kept: tuple[bool, ...]
    weights: Weights


@dataclass(frozen=True)
class _Piece:
    """One pair, over durations in which waiting draws constant - power · T."""

    pairs: _Pairs
    candidate: Candidate
    piece: LinearDwell
    energy: float

    @property
    def _target(self) -> float:
        """What the motion alone must need [J] to need no less than the best."""
        return self.energy - float(self.piece.constant[0])

    @property
    def _power(self) -> float:
        return float(self.piece.power[0])

    def _plain(self, shortest: Array, longest: Array) -> Array:
        """The plain bound (B,) [J] for durations between these (B,) [s]."""
        prepared, candidate = self.pairs.prepared, self.candidate
        n = len(shortest)
        displacement = np.tile(candidate.q_goal - candidate.q_start, (n, 1))
        gain, waiting = np.full(n, self._gain), np.full(n, self._power)
        return electrical(prepared, displacement, gain, shortest, longest, waiting)

    @property
    def _gain(self) -> float:
        prepared, candidate = self.pairs.prepared, self.candidate
        return prepared.potential(candidate.q_goal) - prepared.potential(candidate.q_start)

    def bound(self, shortest: float, longest: float, deadline: Deadline) -> float:
        """The least over the piece's durations, wait included [J]; at most the best energy."""
        probes = np.geomspace(shortest, longest, PROBES) if longest > shortest else np.array([shortest])
        probes[0], probes[-1] = shortest, longest
        plain = self._plain(probes, probes)
        low = np.flatnonzero(plain < self._target)
        if not len(low):
            # convex: its least value may lie between two probes, and is the plain bound's own
            least = float(self._plain(probes[:1], probes[-1:])[0])
            return min(self.energy, least + float(self.piece.constant[0]))
        first, last = probes[max(low[0] - 1, 0)], probes[min(low[-1] + 1, len(probes) - 1)]
        if last > WINDOW * first:
            return -np.inf
        count = max(int(np.ceil(np.log(last / first) / np.log(CELL))), 1)
        edges = np.geomspace(first, last, count + 1)
        edges[0], edges[-1] = first, last
        return min(self.energy, self._least(edges, deadline) + float(self.piece.constant[0]))

    def _least(self, edges: Array, deadline: Deadline) -> float:
        """The least bound [J] of the cells between these durations (n + 1,) [s], without the wait.

        The boxes that motions stay in grow with the duration, so that a few cells at a time have boxes of their own.
        Cells whose plain bound is above the least so far are done.
        """
        shortest, longest = edges[:-1], edges[1:]
        cells, left = self._plain(shortest, longest), np.ones(len(shortest), dtype=bool)
        choices: Sequence[_Choice] = self._choices(self._work(self._duration or float(np.sqrt(edges[0] * edges[-1]))))
        while (open_ := np.flatnonzero(left & (cells <= cells[~left].min(initial=np.inf)))).size:
            group = open_[:GROUP]
            group = group[longest[group] <= longest[group[0]] * CELL**GROUP]
            if deadline.left < TERMS_TIME:
                break
            found = self._bounds(shortest[group], longest[group], choices, deadline)
            cells[group] = np.maximum(cells[group], found[0])
            choices, left[group] = found[1], False
        return float(cells.min())

    def _bounds(
        self, shortest: Array, longest: Array, choices: Sequence[_Choice], deadline: Deadline = NEVER
    ) -> tuple[Array, Sequence[_Choice]]:
        """Dual bounds (B,) [J] of cells, -inf if time is too short, and the choice with the greatest least of them."""
        pairs, arm = self.pairs, self.pairs.prepared.arm
        own = self._duration
        middle = float(np.sqrt(shortest[0] * longest[-1]) if own is None else np.clip(own, shortest[0], longest[-1]))
        x, torque = self._motion(middle)
        share = np.linspace(0.0, 1.0, STEPS + 1)
        linear = np.stack([np.ones_like(share), share], axis=1)
        multipliers = linear @ np.linalg.lstsq(linear, torque, rcond=None)[0]
        half = half_sides(Reference(x, multipliers), arm.active_limits, float(longest[-1]))
        base = arm.base_power + float(arm.drives.inverter_constant.sum())
        best, chosen = np.full(len(shortest), -np.inf), choices[0]
        for kept in sorted({choice.kept for choice in choices}):
            if deadline.left < TERMS_TIME:
                break
            reference = Reference(x, multipliers * np.array(kept))
            terms = path_terms(pairs.chain, reference, pairs.loss, half, self._grid)
            rates = multiplier_rates(reference.multipliers, pairs.loss, pairs.friction.load)
            dual = DualBound(
                terms,
                pairs.loss,
                rates,
                pairs.friction,
                arm.active_limits,
                base,
                self._gain,
                float(longest[-1]),
                pairs.chain.rotor,
            )
            for choice in choices:
                if choice.kept == kept and deadline.left >= BOUND_TIME:
                    value = dual(shortest, longest, choice.weights, self._power)
                    if value.min() > best.min():
                        best, chosen = value, choice
        return best, [chosen]

    @cached_property
    def _hold(self) -> Array:
        """Mean copper loss (nq,) [W] of each joint's gravity torque on the straight line."""
        candidate, pairs = self.candidate, self.pairs
        share = np.linspace(0.0, 1.0, STEPS + 1)[:, None]
        line = candidate.q_start + share * (candidate.q_goal - candidate.q_start)
        return np.asarray(pairs.loss * (pairs.chain.gravity_torque(line)[0] ** 2).mean(axis=0))

    @cached_property
    def _grid(self) -> tuple[int, ...]:
        """The joints with a grid: those that lose most by holding."""
        return tuple(sorted(np.argsort(-self._hold, kind="stable")[:GRID_JOINTS].tolist()))

    def _work(self, duration: float) -> float:
        """η of the dual bound; see its text."""
        if self.pairs.friction.load is not None:
            return 0.0
        displacement = self.candidate.q_goal - self.candidate.q_start
        return WORK * copper_multiplier(self.pairs.prepared, displacement, self._gain, duration)

    def _choices(self, work: float) -> list[_Choice]:
        """What is tried: multipliers of the joints that carry no gravity, also with those that lose most by it."""
        heavy = self.pairs.chain.potential_bound(2).max(axis=1) > WEIGHTLESS
        rank = np.argsort(np.argsort(-self._hold, kind="stable"))
        stiffness = self.pairs.stiffness
        return [
            _Choice(
                kept,
                Weights(
                    scale,
                    np.where(heavy, (1 - MIXING) * factor * stiffness, 0.0),
                    np.where(heavy, MIXING, 1.0) * factor * stiffness,
                    work,
                ),
            )
            for kept in {tuple((~heavy | (rank < count)).tolist()) for count in range(HEAVY + 1)}
            for scale, factor in product(SCALES, STIFFNESSES)
        ]

    @property
    def _duration(self) -> float | None:
        attempt = self.candidate.attempt
        return None if attempt is None or attempt.spline is None else attempt.spline.duration

    def _motion(self, duration: float) -> tuple[Array, Array]:
        """Positions and motor torques (STEPS + 1, nq) of the pair's motion, or of a straight one of this duration."""
        prepared, candidate = self.pairs.prepared, self.candidate
        share = np.linspace(0.0, 1.0, STEPS + 1)
        if candidate.attempt is not None and candidate.attempt.spline is not None:
            spline = candidate.attempt.spline
        else:
            spline = quintic_spline(candidate.q_start, candidate.q_goal, duration)
        q, v, a = sample(spline, share * spline.duration)
        q = np.array(q)
        q[0], q[-1] = candidate.q_start, candidate.q_goal
        return q, prepared.motor_torques(q, v, a)
