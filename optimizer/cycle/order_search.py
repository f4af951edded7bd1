"""The best order of the stops of a cycle: a tour of least energy over groups of stops, by dynamic
programming.

Between two groups the arm carries the same whatever their order, so the cost of a move depends on
its two ends alone. A tour is extended by one group at a time, from every subset of the groups and
every configuration in which the last one is left (Held and Karp, "A dynamic programming approach to
sequencing problems", 1962). As in `LazySearch`, moves weigh their proven bounds first; those of the
least tour are solved, until no tour has a bound below it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.proven_bound import bounded_costs
from joulepath.optimizer.cycle.tours import Tours
from joulepath.optimizer.deadline import Clock, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.free_order import earlier_groups, groups_of
from joulepath.optimizer.problem.stops import PlannedMove, Stop, moves_over
from joulepath.optimizer.progress import Tell, nobody

# share of the deadline that the search for the order may take
SHARE = 0.7


class OrderSearch:
    """The search for the order of the stops of a cycle; `bound` [J] holds for every order once it
    has `run`.

    `exact`: no other order can be better. `tell` gets what is found of single moves.
    """

    def __init__(self, asked: Cycle, clock: Clock, tell: Tell = nobody) -> None:
        assert asked.order is not None
        self.asked, self.order = asked, asked.order
        self.groups = groups_of(asked.order, asked.stops)
        self.moves, self.blocks = _all_moves(asked, self.groups)
        self.search = CycleSearch(
            replace(asked, deadline=SHARE * asked.deadline), clock, self.moves, tell
        )
        self.exact, self.bound, self.best = True, -np.inf, list[int]()

    def run(self) -> Cycle:
        """The cycle with its stops in the best order; once the time is up, in the best one known.

        Raises NoTrajectory if there is none, or DeadlineExceeded if none is known.
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
        return replace(self.asked, stops=stops, order=None)

    def _explore(self) -> None:
        """Find the least tour, all of its moves solved; `best` are its groups so far. The first one
        is the `bound`.
        """
        search, costs = self.search, [leg.cost for leg in self.search.legs]
        known = self.asked.objective == "electrical" and all(leg.closed for leg in search.legs)
        if not known:
            # moves weigh more than their bounds, or there are configurations that no node is
            legs = zip(self.moves, search.legs, strict=True)
            self.bound = self._tours(
                [bounded_costs(self.asked, *leg, search.end) for leg in legs]
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
                if not search.legs[each[0]].known(*each[1:])
            ]
            if not open_ or search.search_end.passed:
                self.exact = not (open_ or search.failed or search.cut_short)
                return
            for each in open_:
                search.try_kind(*each)
            self._put(tours, costs, {k for k, _, _ in open_})

    def _tours(self, costs: Sequence[Array]) -> Tours:
        """The tours with the costs (n, n) [J] of all moves."""
        ends: dict[int | None, npt.NDArray[np.intp]] = {}
        for (origin, to), legs in self.blocks.items():
            if origin is None:
                ends[None] = _ends(self.search.legs[legs[0]].start, len(costs[legs[0]]))
                ends[to] = _ends(self.search.legs[legs[-1]].goal, costs[legs[-1]].shape[1])
        tours = Tours(ends, earlier_groups(self.order, self.groups), self.asked.closed)
        self._put(tours, costs, set(range(len(costs))))
        return tours

    def _put(self, tours: Tours, costs: Sequence[Array], changed: set[int]) -> None:
        """Give the tours the costs of all blocks that have a move of which they changed."""
        # all ways to a group go on by the same moves
        inner = dict[int | None, Array | None]()
        for (origin, to), (first, *others) in self.blocks.items():
            if not changed.isdisjoint((first, *others)):
                if to not in inner:
                    inner[to] = reduce(_through, [costs[k] for k in others]) if others else None
                rest = inner[to]
                tours.put(
                    origin, to, costs[first] if rest is None else _through(costs[first], rest)
                )

    def _moves_of(self, groups: list[int], ends: list[int]) -> list[tuple[int, int, int]]:
        """Leg, start node and goal node of each move of a tour, which leaves the start and the
        groups by the nodes `ends`, and comes to the last of these."""
        places: list[int | None] = [None, *groups, *([None] if self.asked.closed else [])]
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
    asked: Cycle, groups: list[list[Stop]]
) -> tuple[list[PlannedMove], dict[tuple[int | None, int | None], list[int]]]:
    """Every move that some order has; and their numbers from the exit of a group, None for the
    start, to that of another one."""
    moves = list[PlannedMove]()
    blocks: dict[tuple[int | None, int | None], list[int]] = {}
    inside, exits = list[list[int]](), list[str]()
    for group in groups:
        own, arm, place = list[PlannedMove](), asked.arm, START
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
    if asked.closed:
        for origin, exit_ in enumerate(exits):
            blocks[origin, None] = [len(moves)]
            moves.append(PlannedMove(exit_, START, asked.arm, asked.arm))
    return moves, blocks


def _ends(layer: Layer, nodes: int) -> npt.NDArray[np.intp]:
    """The end (n,) of each node of a layer, ascending from 0; one more for a node that stands for
    those not known.
    """
    ends = np.unique(layer.end, return_inverse=True)[1]
    return np.append(ends, np.full(nodes - len(ends), ends[-1] + 1))


def _through(one: Array, other: Array) -> Array:
    """The least cost (a, c) [J] over all nodes between, from costs (a, b) and (b, c)."""
    rows, columns = np.nonzero(np.isfinite(other))
    if len(np.unique(columns)) == len(columns):
        # a line or a path, which leads to each node from one other
        total = np.full((len(one), other.shape[1]), np.inf)
        total[:, columns] = one[:, rows] + other[rows, columns]
        return total
    total = np.empty((len(one), other.shape[1]))
    for k, row in enumerate(one):
        checkpoint()
        total[k] = (row[:, None] + other).min(axis=0)
    return total
