"""Legs of a cycle: all pairs of configurations of two layers, with bounds and energies of the
motions between them.

The energy of a motion depends on the joint displacement, the configurations up to full turns, and
the payload. Pairs that agree in these form one kind. A kind has its proven bound first, and the
energy of a motion once one of its pairs is solved. Only the range of a joint can distinguish pairs
of a kind; such a pair has a value of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.lower_bound import priced_bounds
from joulepath.optimizer.bounds.priced_work import priced_work_bounds
from joulepath.optimizer.cycle.kinds import displacements_between, kinds_of
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.problem.stops import PlannedMove


@dataclass(frozen=True)
class LegSettings:
    """Settings and limits of the legs of a cycle."""

    most_pairs: int = 4_000_000
    """Most pairs of configurations of one leg; a matrix of this size takes 30 MB."""
    most_pairs_of_cycle: int = 30_000_000
    """Most pairs of all legs together; they take 1.6 GB with a free order."""
    most_path_nodes: int = 2000
    """Most nodes of a stop with lines or a path; only the diagonal of its matrix counts."""
    path_excess: float = 0.2
    """Share of the bound by which an unsolved line or path weighs more, if its ends are samples of
    infinitely many: the bound is then of free motions, and no proof is lost."""
    kinds_per_check: int = 2048
    """Kinds between two checks of the deadline, some ten milliseconds."""
    near_limit: float = 1e-3
    """Distance of all control points from the limits above which these do not affect a motion
    [rad]."""


LEG = LegSettings()


@dataclass(eq=False)
class Leg:
    """All motions from one layer to the next.

    Attributes:
        prepared: problem of the leg.
        start: layer at the start, with s nodes.
        goal: layer at the goal, with g nodes.
        kind: number of the kind of every pair, shape (s, g); -1 if no motion may connect the pair.
        pair: pair of every kind farthest from the joints' limits, shape (k, 2).
        displacement: displacement of every kind, shape (k, nq) [rad].
        levels: potential energies at both ends of every kind, shape (k, 2) [J].
        bound: proven lower bound of the objective of every kind, shape (k,) [J].
        dwell: cost of the dwell at every node of the goal, shape (g,) [J].
        cost: cost of every pair with its dwell, shape (s, g) [J]: the objective found if the pair
            is solved, inf without a motion, otherwise the bound, or more where bounds are weak.
        solved: objective of the solved kinds without the dwell [J].
        exact: objective of pairs with a value of their own, without the dwell [J].
    """

    prepared: PreparedProblem
    start: Layer
    goal: Layer
    kind: npt.NDArray[np.intp]
    pair: npt.NDArray[np.intp]
    displacement: Array
    levels: Array
    bound: Array
    dwell: Array
    cost: Array
    solved: dict[int, float] = field(default_factory=dict)
    _by_target: dict[int, PreparedProblem] = field(default_factory=dict)
    exact: dict[tuple[int, int], float] = field(default_factory=dict)

    @classmethod
    def of(cls, prepared: PreparedProblem, start: Layer, goal: Layer, dwell: Array) -> Leg:
        """The leg of all pairs with their bounds.

        Raises:
            InvalidProblem: there are too many pairs.
        """
        if len(start.q) * len(goal.q) > LEG.most_pairs:
            raise InvalidProblem(
                "stops",
                f"From {start.name} to {goal.name} there are {len(start.q) * len(goal.q)} pairs "
                f"of arm configurations, but at most {LEG.most_pairs} are possible: give fewer "
                "targets, a `branch`, or `windings` false.",
            )
        return cls._of_kinds(prepared, start, goal, *kinds_of(start, goal, prepared), dwell)

    @classmethod
    def along_path(cls, prepared: PreparedProblem, start: Layer, goal: Layer, dwell: Array) -> Leg:
        """The leg along a line or path of the TCP, which connects nodes of the same number; one
        kind per end.

        Raises:
            InvalidProblem: there are too many nodes.
        """
        if len(start.q) > LEG.most_path_nodes:
            raise InvalidProblem(
                "stops",
                f"{goal.name} has {len(start.q)} arm configurations, but at most "
                f"{LEG.most_path_nodes} are possible with a line or a path: give fewer targets, "
                "a `branch`, or `windings` false.",
            )
        _, first, number = np.unique(start.end, return_index=True, return_inverse=True)
        kind = np.full((len(start.q), len(goal.q)), -1)
        np.fill_diagonal(kind, number)
        leg = cls._of_kinds(prepared, start, goal, kind, np.column_stack([first, first]), dwell)
        if not leg.closed:
            leg.raise_unsolved_costs(LEG.path_excess)
        return leg

    @classmethod
    def _of_kinds(
        cls,
        prepared: PreparedProblem,
        start: Layer,
        goal: Layer,
        kind: npt.NDArray[np.intp],
        pair: npt.NDArray[np.intp],
        dwell: Array,
    ) -> Leg:
        """The leg with given kinds, and their bounds."""
        displacement, levels = displacements_between(prepared, start, goal, pair)
        longest = (
            DURATIONS.longest
            if prepared.problem.duration_max is None
            else prepared.problem.duration_max
        )
        bound = _kind_bounds(prepared, start.q[pair[:, 0]], displacement, levels, 0.0, longest)
        cost = _pair_costs(bound + _friction_estimate(prepared, displacement), kind, dwell)
        return cls(prepared, start, goal, kind, pair, displacement, levels, bound, dwell, cost)

    def priced(self, price: float, longest: float) -> Leg:
        """The same leg, unsolved, with the objective + price · duration as cost.

        Args:
            price: price of time [W]; dwells have their fixed duration.
            longest: longest duration of a motion [s].
        """
        q_start = self.start.q[self.pair[:, 0]]
        bound = _kind_bounds(self.prepared, q_start, self.displacement, self.levels, price, longest)
        cost = _pair_costs(
            bound + _friction_estimate(self.prepared, self.displacement), self.kind, self.dwell
        )
        return replace(self, bound=bound, cost=cost, solved={}, exact={})

    def raise_unsolved_costs(self, share: float) -> None:
        """Raise the cost of all pairs, while unsolved, by a share of their bounds."""
        self.cost += share * np.abs(_pair_costs(self.bound, self.kind, np.zeros(len(self.goal.q))))

    def prepared_for(self, s: int, g: int) -> PreparedProblem:
        """Problem of a pair's motion; pairs of different targets have different lines or paths."""
        if self.prepared.problem.tool_path is None:
            return self.prepared
        target = self.start.ends[self.start.end[s]].target
        if target not in self._by_target:
            problem = replace(self.prepared.problem, start=self.start.q[s], goal=self.goal.q[g])
            self._by_target[target] = self.prepared.beside(problem)
        return self._by_target[target]

    def trace_of(self, problem: Problem) -> Trace | None:
        """Trace of a pair's problem along its line or path; None if it is not known."""
        # an approach was followed from its stop to its outer end
        backwards = not self.goal.traces
        layer = self.start if backwards else self.goal
        if self.prepared.problem.tool_path is None or not layer.traces:
            return None
        q_start, q_goal = np.asarray(problem.start), np.asarray(problem.goal)
        nodes = np.flatnonzero(
            (self.start.q == q_start).all(axis=1) & (self.goal.q == q_goal).all(axis=1)
        )
        if not len(nodes):
            return None
        trace = layer.traces[int(layer.end[nodes[0]])]
        trace = trace.reversed() if backwards else trace
        # all nodes of an end have the same trace up to full turns
        turned = np.round((q_start - trace.q[0]) / (2 * np.pi)) * (2 * np.pi)
        return replace(trace, q=np.concatenate([q_start[None], trace.q[1:] + turned]))

    @property
    def least_costs(self) -> Array:
        """Proven lower bounds (s, g) [J] of all pairs, with the dwell at the goal."""
        return _pair_costs(self.bound, self.kind, self.dwell)

    def is_near_a_limit(self, motion: Spline | None) -> bool:
        """Whether a motion comes near the end of a joint's range, or is None.

        Another pair of its kind may then need less energy.
        """
        if motion is None:
            return True
        limits, points = self.prepared.arm.active_limits, motion.control_points
        return bool(
            (points < limits.q_min + LEG.near_limit).any()
            or (points > limits.q_max - LEG.near_limit).any()
        )

    @property
    def layers(self) -> list[Layer]:
        """Layers of all places of the motions, in order."""
        return [self.start, self.goal]

    @property
    def closed(self) -> bool:
        """Whether all configurations of the layers are known: none is a sample, none can be
        missing.
        """
        return all(layer.closed for layer in self.layers)

    def passes(self, s: int, g: int) -> list[Array]:
        """Joint positions (nq,) [rad] that the motion of a pair passes through."""
        return []

    def is_pair_solved(self, s: int, g: int) -> bool:
        """Whether the pair, or another one of its kind, is solved."""
        return (s, g) in self.exact or int(self.kind[s, g]) in self.solved

    @property
    def is_solved(self) -> Mask:
        """Mask (s, g) of the solved pairs, by themselves or by another pair of their kind."""
        mask = np.isin(self.kind, list(self.solved))
        for pair in self.exact:
            mask[pair] = True
        return mask

    def set_kind(self, kind: int, energy: float) -> None:
        """Set the energy [J] of the motions of a kind; inf if there is no motion."""
        self.solved[kind] = energy
        own = self.kind == kind
        self.cost[own] = (energy + np.broadcast_to(self.dwell, self.cost.shape))[own]
        for (s, g), value in self.exact.items():
            self.cost[s, g] = value + self.dwell[g]

    def set_pair(self, s: int, g: int, energy: float) -> None:
        """Set the energy [J] of the motion of one pair; inf if there is no motion."""
        self.exact[s, g] = energy
        self.cost[s, g] = energy + self.dwell[g]


def check_size(moves: Sequence[PlannedMove], layers: Mapping[str, Layer]) -> None:
    """Check the number of pairs of configurations of all legs.

    Raises:
        InvalidProblem: there are too many pairs.
    """
    pairs = [
        len(layers[a].q) * len(layers[b].q)
        for move in moves
        for a, b in pairwise((move.start, *move.through, move.goal))
    ]
    if sum(pairs) > LEG.most_pairs_of_cycle:
        raise InvalidProblem(
            "stops",
            f"The moves of this cycle have {sum(pairs)} pairs of arm configurations, but at most "
            f"{LEG.most_pairs_of_cycle} are possible: give fewer stops or targets, a `branch`, "
            "or `windings` false.",
        )


def _pair_costs(of_kind: Array, kind: npt.NDArray[np.intp], dwell: Array) -> Array:
    """Costs (s, g) [J] of all pairs from those of their kinds (k,) and the dwell (g,); inf without
    kind.
    """
    return np.where(kind < 0, np.inf, of_kind[kind] + dwell)


def _friction_estimate(prepared: PreparedProblem, displacement: Array) -> Array:
    """Estimated excess (k,) [J] of mechanical work over its bound, for the order of unsolved kinds.

    Bounds on mechanical work hardly depend on the travel. The friction over the travel, though no
    part of this work, does.
    """
    if prepared.problem.objective == "electrical":
        return np.zeros(len(displacement))
    return np.asarray(np.abs(displacement) @ prepared.arm.friction_law.coulomb)


def _kind_bounds(
    prepared: PreparedProblem,
    q_start: Array,
    displacement: Array,
    levels: Array,
    price: float,
    longest: float,
) -> Array:
    """Proven lower bounds (k,) [J] of objective + price · duration of kinds.

    Args:
        prepared: problem of the leg.
        q_start: configurations at the start, shape (k, nq) [rad].
        displacement: joint displacements, shape (k, nq) [rad].
        levels: potential energies at both ends, shape (k, 2) [J].
        price: price of time [W].
        longest: longest duration of a motion [s].
    """
    if prepared.problem.objective == "mechanical":
        return bounds_of(
            lambda q, x, ends: priced_work_bounds(prepared, q, q + x, ends, price, longest),
            q_start,
            displacement,
            levels,
        )
    return bounds_of(
        lambda x, ends: priced_bounds(prepared, x, ends[:, 1] - ends[:, 0], price, longest),
        displacement,
        levels,
    )


def bounds_of(bound: Callable[..., Array], *rows: Array) -> Array:
    """Proven lower bounds (k,) [J] by a function of rows (k, ...), with checks of the deadline."""
    bounds = []
    for low in range(0, len(rows[0]), LEG.kinds_per_check):
        checkpoint()
        bounds.append(bound(*(each[low : low + LEG.kinds_per_check] for each in rows)))
    return np.concatenate(bounds)
