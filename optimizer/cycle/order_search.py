"""Best order of the stops of a cycle: a tour of least energy over groups of stops.

Between two groups the arm carries the same payload in every order, so the cost of a move depends on
its two ends alone. The best tour is found by dynamic programming (`held_karp`). As in `LazySearch`,
moves weigh their proven bounds first, and the moves of the least tour are solved until no tour has
a bound below it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.held_karp import HeldKarp
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.proven_bound import bounded_costs
from joulepath.optimizer.deadline import Clock, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.free_order import earlier_groups, groups_of
from joulepath.optimizer.problem.stops import PlannedMove, Stop, moves_over
from joulepath.optimizer.progress import Tell, no_listener


@dataclass(frozen=True)
class OrderSearchSettings:
    """Settings of the search for the order of the stops."""

    deadline_share: float = 0.7
    """Share of the deadline for this search."""


ORDER_SEARCH = OrderSearchSettings()


class OrderSearch:
    """Search for the order of the stops of a cycle.

    After `run`, `bound` [J] holds for every order, and `exact` tells whether no other order can be
    better.

    Args:
        cycle: cycle with a free order.
        clock: function that returns the time [s].
        tell: receives the progress of single moves.
    """

    def __init__(self, cycle: Cycle, clock: Clock, tell: Tell = no_listener) -> None:
        assert cycle.order is not None
        self.cycle, self.order = cycle, cycle.order
        self.groups = groups_of(cycle.order, cycle.stops)
        self.moves, self.blocks = _all_moves(cycle, self.groups)
        self.search = CycleSearch(
            replace(cycle, deadline=ORDER_SEARCH.deadline_share * cycle.deadline),
            clock,
            self.moves,
            tell,
        )
        self.exact, self.bound, self.best = True, -np.inf, list[int]()

    def run(self) -> Cycle:
        """The cycle with its stops in the best order known.

        Raises:
            NoTrajectory: there is no tour.
            DeadlineExceeded: the deadline passed before a tour was known.
        """
        search = self.search
        try:
            with watch(search.end):
                self._explore()
        except DeadlinePassed:
            self.exact = False
        if not self.best:
            raise DeadlineExceeded([])
        stops = [stop for k in self.best for stop in self.groups[k]]
        return replace(self.cycle, stops=stops, order=None)

    def _explore(self) -> None:
        """Find the least tour with all moves solved; `best` has its groups, `bound` the cost of the
        first.
        """
        search, costs = self.search, [leg.cost for leg in self.search.legs]
        known = self.cycle.objective == "electrical" and all(leg.closed for leg in search.legs)
        if not known:
            # moves weigh more than their bounds, or some configurations are no nodes
            legs = zip(self.moves, search.legs, strict=True)
            self.bound = self._tours(
                [bounded_costs(self.cycle, *leg, search.end) for leg in legs]
            ).least()[0]
        tours = self._tours(costs)
        while True:
            value, groups, ends = tours.least()
            self.bound = max(self.bound, value) if known and not self.best else self.bound
            if not np.isfinite(value):
                raise DeadlineExceeded([]) if search.cut_short else NoTrajectory([])
            self.best = groups
            open_ = [
                each
                for each in self._moves_of(groups, ends)
                if not search.legs[each[0]].is_pair_solved(*each[1:])
            ]
            if not open_ or search.search_end.passed:
                self.exact = not (open_ or search.failed or search.cut_short)
                return
            for each in open_:
                search.try_kind(*each)
            self._update(tours, costs, {k for k, _, _ in open_})

    def _tours(self, costs: Sequence[Array]) -> HeldKarp:
        """Dynamic program over tours with the costs (n, n) [J] of all moves."""
        ends: dict[int | None, npt.NDArray[np.intp]] = {}
        for (origin, to), legs in self.blocks.items():
            if origin is None:
                ends[None] = _end_numbers(self.search.legs[legs[0]].start, len(costs[legs[0]]))
                ends[to] = _end_numbers(self.search.legs[legs[-1]].goal, costs[legs[-1]].shape[1])
        tours = HeldKarp(ends, earlier_groups(self.order, self.groups), self.cycle.closed)
        self._update(tours, costs, set(range(len(costs))))
        return tours

    def _update(self, tours: HeldKarp, costs: Sequence[Array], changed: set[int]) -> None:
        """Set the costs of all blocks with a changed move."""
        # moves inside a group are the same whatever the group before it
        inner = dict[int | None, Array | None]()
        for (origin, to), (first, *others) in self.blocks.items():
            if not changed.isdisjoint((first, *others)):
                if to not in inner:
                    inner[to] = (
                        reduce(_joined_costs, [costs[k] for k in others]) if others else None
                    )
                rest = inner[to]
                tours.set_costs(
                    origin, to, costs[first] if rest is None else _joined_costs(costs[first], rest)
                )

    def _moves_of(self, groups: list[int], ends: list[int]) -> list[tuple[int, int, int]]:
        """Leg, start node and goal node of every move of a tour.

        Args:
            groups: groups in order of visit.
            ends: nodes at the start and at the exit of every group, and at the end of a closed
                tour.
        """
        places: list[int | None] = [None, *groups, *([None] if self.cycle.closed else [])]
        found = list[tuple[int, int, int]]()
        for k, (first, last) in enumerate(pairwise(places)):
            legs = self.blocks[first, last]
            costs = [self.search.legs[leg].cost for leg in legs]
            costs = [costs[0][ends[k] : ends[k] + 1], *costs[1:]]
            costs[-1] = costs[-1][:, ends[k + 1] : ends[k + 1] + 1]
            nodes = LeastChain(costs, False).find()[1]
            inner = [ends[k], *nodes[1:-1], ends[k + 1]]
            found += [(leg, inner[n], inner[n + 1]) for n, leg in enumerate(legs)]
        return found


def _all_moves(
    cycle: Cycle, groups: list[list[Stop]]
) -> tuple[list[PlannedMove], dict[tuple[int | None, int | None], list[int]]]:
    """Every move of any order, and the moves of every block.

    A block leads from the exit of a group, or the start (None), to the exit of another group.
    """
    moves = list[PlannedMove]()
    blocks: dict[tuple[int | None, int | None], list[int]] = {}
    inside, exits = list[list[int]](), list[str]()
    for group in groups:
        own, arm, place = list[PlannedMove](), cycle.arm, START
        for stop in group:
            after = arm if stop.payload is None else replace(arm, payload=stop.payload)
            own += moves_over(stop, place, arm, after)
            arm, place = after, own[-1].goal
        inside.append(list(range(len(moves), len(moves) + len(own))))
        exits.append(place)
        moves += own
    for to, own_moves in enumerate(inside):
        blocks[None, to] = own_moves
        for origin, exit_ in enumerate(exits):
            if origin != to:
                blocks[origin, to] = [len(moves), *own_moves[1:]]
                moves.append(replace(moves[own_moves[0]], start=exit_))
    if cycle.closed:
        for origin, exit_ in enumerate(exits):
            blocks[origin, None] = [len(moves)]
            moves.append(PlannedMove(exit_, START, cycle.arm, cycle.arm))
    return moves, blocks


def _end_numbers(layer: Layer, nodes: int) -> npt.NDArray[np.intp]:
    """Number (n,) of the end of every node, ascending from 0; an extra node stands for unknown
    ones.
    """
    ends = np.unique(layer.end, return_inverse=True)[1]
    return np.append(ends, np.full(nodes - len(ends), ends[-1] + 1))


def _joined_costs(one: Array, other: Array) -> Array:
    """Least costs (a, c) [J] over the nodes between, from costs (a, b) and (b, c)."""
    rows, columns = np.nonzero(np.isfinite(other))
    if len(np.unique(columns)) == len(columns):
        # a line or path leads to every node from a single node
        total = np.full((len(one), other.shape[1]), np.inf)
        total[:, columns] = one[:, rows] + other[rows, columns]
        return total
    total = np.empty((len(one), other.shape[1]))
    for k, row in enumerate(one):
        checkpoint()
        total[k] = (row[:, None] + other).min(axis=0)
    return total
