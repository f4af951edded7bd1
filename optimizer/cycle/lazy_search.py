"""Lazy search for a least chain: bounds of all legs first, motions only along the least chain.

All legs weigh their proven bounds at first. The least chain is found, its legs are solved and weigh
the energies of their motions, and so on until every leg of the least chain is solved. Then no chain
has a bound below it. After Dellin and Srinivasa, "A unifying formalism for shortest path problems
with expensive edge evaluations" (2016).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.errors import NoSequence
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.motion.spline import Spline

Pair = tuple[int, int, int]
"""Leg, start node and goal node of a move."""


@dataclass(frozen=True)
class LazySearchSettings:
    """Settings of the lazy search."""

    share_of_leg: float = 1 / 8
    """Share of the time left that one leg may take; a leg without a motion among obstacles would
    take all of it."""
    same_cost: float = 1e-9
    """Difference below which two chains cost the same [J]."""


LAZY_SEARCH = LazySearchSettings()


class LazySearch(ABC):
    """A lazy search over the legs of a cycle.

    `failed`: some leg has no motion, without a proof. `cut_short`: the time was too short for some
    leg. `causes` are the reasons of the last failure of a leg, by its number.

    Args:
        legs: the legs.
        closed: whether a chain ends in its first node.
        search_end: deadline of the search.
    """

    def __init__(self, legs: Sequence[Leg], closed: bool, search_end: Deadline) -> None:
        self.legs, self.closed, self.search_end = list(legs), closed, search_end
        self.failed = self.cut_short = False
        self.causes: dict[int, str] = {}
        self.least_chain = LeastChain([leg.cost for leg in self.legs], closed)

    @abstractmethod
    def attempt(self, k: int, s: int, g: int) -> float | None:
        """Cost [J] of a motion of a pair, without the dwell.

        Returns:
            The cost; inf if no motion is found, None if the time is up.
        """

    @abstractmethod
    def motion(self, k: int, s: int, g: int) -> Spline | None:
        """Motion found by `attempt`; None if there is none."""

    def try_kind(self, k: int, s: int, g: int) -> None:
        """Attempt a motion for the kind of a pair, and set its cost unless the time is up.

        If the range of a joint limits the motion, the pair of the kind farthest from the limits is
        tried too, and the first pair keeps a value of its own.
        """
        leg = self.legs[k]
        kind, before = int(leg.kind[s, g]), float(leg.cost[s, g])
        value = self.attempt(k, s, g)
        centre_s, centre_g = leg.pair[kind].tolist()
        if (
            value is not None
            and (s, g) != (centre_s, centre_g)
            and leg.is_near_a_limit(self.motion(k, s, g))
        ):
            if np.isfinite(value):
                leg.set_pair(s, g, value)
            value = self.attempt(k, centre_s, centre_g)
        if value is not None:
            leg.set_kind(kind, value)
        # an unsolved pair may weigh more than its bound, and a pair may have a value of its own
        least = min(float(leg.cost[s, g]), np.inf if value is None else value + float(leg.dwell[g]))
        self.least_chain.lower(max(before - least, 0.0))

    def out_of_time(self) -> float | None:
        """Cost of a leg without enough time: inf, or None if the whole search is out of time."""
        self.cut_short = True
        return None if self.search_end.passed else np.inf

    def pairs(self, nodes: list[int]) -> Iterator[Pair]:
        """Leg, start node and goal node of every move of a chain."""
        return ((k, nodes[k], nodes[k + 1]) for k in range(len(self.legs)))

    def cost(self, nodes: list[int]) -> float:
        """Cost [J] of a chain by known motions and bounds, with dwells."""
        return float(sum(self.legs[k].cost[s, g] for k, s, g in self.pairs(nodes)))

    def dwells(self, nodes: list[int]) -> float:
        """Energy [J] of the dwells of a chain."""
        return sum(float(self.legs[k].dwell[g]) for k, _, g in self.pairs(nodes))

    def least_nodes(self) -> list[int]:
        """Nodes of the least chain by known motions and bounds; empty if there is no chain."""
        return self.least_chain.find()[1]

    def explore(self) -> list[int]:
        """Search until all legs of the least chain are solved.

        Returns:
            The nodes of the least chain; once the time is up, of the least solved chain if there is
            one.

        Raises:
            NoSequence: there is no chain.
            DeadlineExceeded: there is no chain, and some leg had too little time.
        """
        while True:
            nodes = self.least_nodes()
            if not nodes:
                raise self._no_chain_error()
            open_ = [
                (k, s, g) for k, s, g in self.pairs(nodes) if not self.legs[k].is_pair_solved(s, g)
            ]
            if not open_:
                return nodes
            for each in open_:
                if self.search_end.passed:
                    self.cut_short = True
                    return self._least_solved() or nodes
                self.try_kind(*each)
            self.chain_tried(nodes)

    @property
    def leaves_chains(self) -> bool:
        """Whether some chain has a bound below the least chain found.

        This is possible where unsolved legs weigh more than their bounds.
        """
        costs = [np.where(leg.is_solved, leg.cost, leg.least_costs) for leg in self.legs]
        return (
            LeastChain(costs, self.closed).find()[0]
            < self.least_chain.find()[0] - LAZY_SEARCH.same_cost
        )

    @abstractmethod
    def chain_tried(self, nodes: list[int]) -> None:
        """Called when every leg of a chain has been tried."""

    def _least_solved(self) -> list[int]:
        """Nodes of the least chain of solved pairs; empty if there is none."""
        costs = [np.where(leg.is_solved, leg.cost, np.inf) for leg in self.legs]
        return LeastChain(costs, self.closed).find()[1]

    def least_through(self, pairs: Iterable[Pair]) -> list[int]:
        """Nodes of the least chain of the given pairs; empty if there is none."""
        costs = [np.full(leg.cost.shape, np.inf) for leg in self.legs]
        for k, s, g in pairs:
            costs[k][s, g] = self.legs[k].cost[s, g]
        return LeastChain(costs, self.closed).find()[1]

    def _no_chain_error(self) -> JoulepathError:
        """Error that names the first stop no chain reaches."""
        if self.cut_short:
            return DeadlineExceeded([])
        reached = np.zeros(len(self.legs[0].start.q))
        for leg in self.legs:
            after = (reached[:, None] + leg.cost).min(axis=0)
            if not np.isfinite(after).any():
                break
            reached = after
        labels = [
            [layer.ends[k].label for k in sorted(set(layer.end[nodes].tolist()))]
            for layer, nodes in (
                (leg.start, np.isfinite(reached)),
                (leg.goal, np.ones(len(leg.goal.q), dtype=bool)),
            )
        ]
        return NoSequence(
            leg.goal.name, labels[0], labels[1], self.causes.get(self.legs.index(leg), "")
        )
