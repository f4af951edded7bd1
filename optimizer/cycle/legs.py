"""The legs of a cycle: every pair of configurations of two layers, with what is known of the motion
between them.

Joint displacement, configurations but for full turns, and payload decide a motion's energy: pairs
that agree in these are one kind of leg. A kind has its proven bound first, and the energy of a
motion once one of its pairs is solved. Only the range of a joint can tell pairs of a kind apart:
where it does, a pair has a value of its own.
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
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import LONGEST_DURATION, Problem
from joulepath.optimizer.problem.stops import PlannedMove

# pairs of configurations of one leg: a matrix of this size takes some 30 MB
MOST_PAIRS = 4_000_000
# pairs of all legs of a cycle: they take some 1.6 GB in a free order
MOST_PAIRS_OF_ROUND = 30_000_000
# nodes of a stop with lines or a path: they make a matrix, of which the diagonal alone counts
MOST_ON_WAY = 2000
# share by which a line or a path weighs more than its bound while it is not solved, where its ends
# are some of infinitely many, so that no proof is lost: the bound is that of free motions between
# them
LIKELY_ON_WAY = 0.2
# kinds between two looks at the deadline: some ten milliseconds
KINDS_PER_CHECK = 2048
# rad: a motion whose control points are farther from the limits is not held back by them
NEAR_LIMIT = 1e-3


@dataclass(eq=False)
class Leg:
    """All motions from one layer to the next.

    `kind` (s, g) numbers the kinds of the pairs; it is -1 for one that no motion may connect.
    `pair` (k, 2) is the pair of each kind that is farthest from the joints' limits, `displacement`
    (k, nq) [rad] and `levels` (k, 2) [J], the potential energies at both ends, are those of the
    kinds, and `bound` (k,) [J] on the objective is proven. `cost` (s, g) [J] is the bound of a pair
    that is not solved, or more where bounds are weak, the objective found of one that is, and inf
    of one without a motion; with it comes what the `dwell` (g,) [J] at the goal adds to it.
    `solved` has the objectives of kinds, and `exact` those of pairs, without the dwell.
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
        """The pairs with their bounds. Raises InvalidProblem if there are too many."""
        if len(start.q) * len(goal.q) > MOST_PAIRS:
            raise InvalidProblem(
                "stops",
                f"From {start.name} to {goal.name} there are {len(start.q) * len(goal.q)} pairs of "
                "arm configurations, "
                f"of at most {MOST_PAIRS}: give fewer targets, a `branch`, or `windings` false.",
            )
        return cls._between(prepared, start, goal, *kinds_of(start, goal, prepared), dwell)

    @classmethod
    def of_way(cls, prepared: PreparedProblem, start: Layer, goal: Layer, dwell: Array) -> Leg:
        """The pairs of nodes of the same number, which a line or path of the TCP connects; a kind
        for each end.
        """
        if len(start.q) > MOST_ON_WAY:
            raise InvalidProblem(
                "stops",
                f"{goal.name} has {len(start.q)} arm configurations, of at most "
                f"{MOST_ON_WAY} with a line "
                "or a path: give fewer targets, a `branch`, or `windings` false.",
            )
        _, first, number = np.unique(start.end, return_index=True, return_inverse=True)
        kind = np.full((len(start.q), len(goal.q)), -1)
        np.fill_diagonal(kind, number)
        leg = cls._between(prepared, start, goal, kind, np.column_stack([first, first]), dwell)
        if not leg.closed:
            leg.weigh_more(LIKELY_ON_WAY)
        return leg

    @classmethod
    def _between(
        cls,
        prepared: PreparedProblem,
        start: Layer,
        goal: Layer,
        kind: npt.NDArray[np.intp],
        pair: npt.NDArray[np.intp],
        dwell: Array,
    ) -> Leg:
        """The leg of given kinds, with their bounds."""
        displacement, levels = between(prepared, start, goal, pair)
        longest = (
            LONGEST_DURATION
            if prepared.problem.duration_max is None
            else prepared.problem.duration_max
        )
        bound = _kind_bounds(prepared, start.q[pair[:, 0]], displacement, levels, 0.0, longest)
        cost = _costs(bound + _beyond(prepared, displacement), kind, dwell)
        return cls(prepared, start, goal, kind, pair, displacement, levels, bound, dwell, cost)

    def priced(self, price: float, longest: float) -> Leg:
        """The same leg with what objective + price · duration needs, of motions of at most
        `longest` [s]; none solved.

        `price` [W]; dwells last as long as they do.
        """
        q_start = self.start.q[self.pair[:, 0]]
        bound = _kind_bounds(self.prepared, q_start, self.displacement, self.levels, price, longest)
        cost = _costs(bound + _beyond(self.prepared, self.displacement), self.kind, self.dwell)
        return replace(self, bound=bound, cost=cost, solved={}, exact={})

    def weigh_more(self, share: float) -> None:
        """Let every pair weigh more than its bound while it is not solved, by this share of the
        bound.
        """
        self.cost += share * np.abs(_costs(self.bound, self.kind, np.zeros(len(self.goal.q))))

    def prepared_for(self, s: int, g: int) -> PreparedProblem:
        """The problem of a pair's motion: what reaches another target goes along another line."""
        if self.prepared.problem.tool_path is None:
            return self.prepared
        target = self.start.ends[self.start.end[s]].target
        if target not in self._by_target:
            problem = replace(self.prepared.problem, start=self.start.q[s], goal=self.goal.q[g])
            self._by_target[target] = PreparedProblem.of(problem)
        return self._by_target[target]

    def traces_of(self, problem: Problem) -> dict[bytes, Trace]:
        """The line or path of a pair's problem as the arm follows it, by the bytes of its start;
        none if not known.
        """
        if self.prepared.problem.tool_path is None or not self.goal.traces:
            return {}
        q_start, q_goal = np.asarray(problem.start), np.asarray(problem.goal)
        nodes = np.flatnonzero(
            (self.start.q == q_start).all(axis=1) & (self.goal.q == q_goal).all(axis=1)
        )
        if not len(nodes):
            return {}
        trace = self.goal.traces[int(self.goal.end[nodes[0]])]
        # but for full turns, the way is the same from every node of an end
        turned = np.round((q_start - trace.q[0]) / (2 * np.pi)) * (2 * np.pi)
        return {
            q_start.tobytes(): replace(
                trace, q=np.concatenate([q_start[None], trace.q[1:] + turned])
            )
        }

    @property
    def least_costs(self) -> Array:
        """Proven lower bounds (s, g) [J] of all pairs, with the dwell at the goal."""
        return _costs(self.bound, self.kind, self.dwell)

    def is_near_a_limit(self, motion: Spline | None) -> bool:
        """Whether a motion comes to the end of a joint's range, or there is none: another pair of
        its kind may need less then."""
        if motion is None:
            return True
        limits, points = self.prepared.arm.active_limits, motion.control_points
        return bool(
            (points < limits.q_min + NEAR_LIMIT).any() or (points > limits.q_max - NEAR_LIMIT).any()
        )

    @property
    def layers(self) -> list[Layer]:
        """The layers of all places of its motions, in their order."""
        return [self.start, self.goal]

    @property
    def closed(self) -> bool:
        """Whether the configurations of all its layers are known: none is a sample of others, none
        may be missing.
        """
        return all(layer.complete and not layer.sampled for layer in self.layers)

    def passes(self, s: int, g: int) -> list[Array]:
        """Joint positions (nq,) [rad] that the motion of a pair passes through."""
        return []

    def known(self, s: int, g: int) -> bool:
        """Whether the pair, or another one of its kind, is solved."""
        return (s, g) in self.exact or int(self.kind[s, g]) in self.solved

    @property
    def is_solved(self) -> Mask:
        """Whether each pair (s, g), or another one of its kind, is solved."""
        known = np.isin(self.kind, list(self.solved))
        for pair in self.exact:
            known[pair] = True
        return known

    def set_kind(self, kind: int, energy: float) -> None:
        """The energy [J] of a motion of this kind; inf if there is none."""
        self.solved[kind] = energy
        own = self.kind == kind
        self.cost[own] = (energy + np.broadcast_to(self.dwell, self.cost.shape))[own]
        for (s, g), value in self.exact.items():
            self.cost[s, g] = value + self.dwell[g]

    def set_pair(self, s: int, g: int, energy: float) -> None:
        """The energy [J] of the motion of this pair; inf if it has none."""
        self.exact[s, g] = energy
        self.cost[s, g] = energy + self.dwell[g]


def check_size(moves: Sequence[PlannedMove], layers: Mapping[str, Layer]) -> None:
    """Raises InvalidProblem if the legs of a cycle have too many pairs of configurations
    together."""
    pairs = [
        len(layers[a].q) * len(layers[b].q)
        for move in moves
        for a, b in pairwise((move.start, *move.through, move.goal))
    ]
    if sum(pairs) > MOST_PAIRS_OF_ROUND:
        raise InvalidProblem(
            "stops",
            f"The moves of this cycle have {sum(pairs)} pairs of arm configurations, of at most "
            f"{MOST_PAIRS_OF_ROUND}: "
            "give fewer stops or targets, a `branch`, or `windings` false.",
        )


def kinds_of(
    start: Layer, goal: Layer, prepared: PreparedProblem
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """The kind (s, g) of each pair, and of each kind the pair (k, 2) that is farthest from the
    limits.
    """
    lowest, highest = (f(np.vstack([start.turns, goal.turns]), axis=0) for f in (np.min, np.max))
    base = 2 * (highest - lowest) + 1
    place = np.concatenate([[1], np.cumprod(base[:-1])])
    turned = (goal.turns @ place)[None, :] - (start.turns @ place)[:, None]
    ends = start.end[:, None] * len(goal.ends) + goal.end[None, :]
    code = ends * (2 * int(np.abs(turned).max(initial=0)) + 1) + turned
    limits = prepared.arm.active_limits
    middle, half = (limits.q_max + limits.q_min) / 2, (limits.q_max - limits.q_min) / 2
    edge = [(np.abs(layer.q - middle) / half).max(axis=1) for layer in (start, goal)]
    order = np.argsort(np.maximum(edge[0][:, None], edge[1][None, :]), axis=None, kind="stable")
    _, first, kind = np.unique(code.ravel()[order], return_index=True, return_inverse=True)
    of_pair = np.empty(code.size, dtype=np.intp)
    of_pair[order] = kind
    return of_pair.reshape(code.shape), np.column_stack(np.unravel_index(order[first], code.shape))


def between(
    prepared: PreparedProblem, start: Layer, goal: Layer, pair: npt.NDArray[np.intp]
) -> tuple[Array, Array]:
    """Displacements (k, nq) [rad] of pairs (k, 2), and the potential energies (k, 2) [J] at their
    ends.
    """
    ends = [(layer, layer.end[nodes]) for layer, nodes in zip((start, goal), pair.T, strict=True)]
    levels = [
        np.array([prepared.potential(end.q) for end in layer.ends])[own] for layer, own in ends
    ]
    return goal.q[pair[:, 1]] - start.q[pair[:, 0]], np.column_stack(levels)


def _costs(of_kind: Array, kind: npt.NDArray[np.intp], dwell: Array) -> Array:
    """Values (s, g) [J] of all pairs from those of their kinds (k,), with the dwell (g,); inf for
    pairs of no kind.
    """
    return np.where(kind < 0, np.inf, of_kind[kind] + dwell)


def _beyond(prepared: PreparedProblem, displacement: Array) -> Array:
    """How much more than its bound a kind weighs while it is not solved (k,) [J]: an estimate, for
    mechanical work.

    The bounds on work hardly tell long ways from short ones. What friction takes on the way, which
    is no part of this work, does.
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
    """Proven lower bounds (k,) [J] on objective + price · duration of kinds, of motions of at most
    `longest` [s].
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
    """Proven lower bounds (k,) [J], by a `bound` on rows (k, ...) of some quantities."""
    bounds = []
    for low in range(0, len(rows[0]), KINDS_PER_CHECK):
        checkpoint()
        bounds.append(bound(*(each[low : low + KINDS_PER_CHECK] for each in rows)))
    return np.concatenate(bounds)
