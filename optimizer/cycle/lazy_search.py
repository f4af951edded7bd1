"""The lazy search of a least chain: bounds of all legs first, then a motion where the least chain
goes.

All legs weigh their proven bounds. The least chain through them is found, its legs are solved and
weigh what was found, and so on until every leg of the least chain is solved: then no chain has a
bound below it. After Dellin and Srinivasa, "A unifying formalism for shortest path problems with
expensive edge evaluations" (2016).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.errors import NoSequence
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.motion.spline import Spline

# share of the search's time left that one leg may take: among obstacles, one without a way would
# take all of it
SHARE_OF_A_LEG = 1 / 8
# J: a chain is no better than another one by less
SAME = 1e-9


class LazySearch(ABC):
    """A search over `legs`, whose time is up at `search_end`.

    `failed`: some leg has no motion and is not proven to have none. `cut_short`: for some leg the
    time was too short. `causes` say why a leg's last attempt failed, by the number of the leg.
    """

    def __init__(self, legs: Sequence[Leg], closed: bool, search_end: Deadline) -> None:
        self.legs, self.closed, self.search_end = list(legs), closed, search_end
        self.failed = self.cut_short = False
        self.causes: dict[int, str] = {}
        self._chain = LeastChain([leg.cost for leg in self.legs], closed)

    @abstractmethod
    def attempt(self, k: int, s: int, g: int) -> float | None:
        """What a motion of a pair needs [J], the dwell left out: inf if none is found, None once
        the time is up.
        """

    @abstractmethod
    def motion(self, k: int, s: int, g: int) -> Spline | None:
        """The motion that `attempt` found for a pair; None if it found none."""

    def try_kind(self, k: int, s: int, g: int) -> None:
        """Give the kind of a pair what its motion needs; leave it as it is once the time is up.

        Where the range of a joint is in the way of a pair, the pair of its kind that is farthest
        from the limits is tried, too: the first one has a value of its own then.
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
        # some legs weigh more than their bounds before they are solved; the pair may have a value
        # of its own
        least = min(float(leg.cost[s, g]), np.inf if value is None else value + float(leg.dwell[g]))
        self._chain.lower(max(before - least, 0.0))

    def late(self) -> float | None:
        """What a leg for which the time was too short is worth: without its share of it, no other
        is tried.
        """
        self.cut_short = True
        return None if self.search_end.passed else np.inf

    def pairs(self, nodes: list[int]) -> Iterator[tuple[int, int, int]]:
        """Leg, start node and goal node of each move of a chain."""
        return ((k, nodes[k], nodes[k + 1]) for k in range(len(self.legs)))

    def cost(self, nodes: list[int]) -> float:
        """What a chain needs as far as it is known, dwells included."""
        return float(sum(self.legs[k].cost[s, g] for k, s, g in self.pairs(nodes)))

    def dwells(self, nodes: list[int]) -> float:
        """Energy [J] of the dwells of a chain."""
        return sum(float(self.legs[k].dwell[g]) for k, _, g in self.pairs(nodes))

    def least(self) -> list[int]:
        """The nodes of the least chain, as far as motions and bounds tell by now; none if there is
        no chain.
        """
        return self._chain.find()[1]

    def explore(self) -> list[int]:
        """The nodes of the least chain, all of its legs solved; once the time is up, of the least
        solved one.

        If none is solved by then, those of the least chain. Raises NoSequence, or DeadlineExceeded
        if some leg that might close the gap was given too little time.
        """
        while True:
            nodes = self.least()
            if not nodes:
                raise self._no_chain()
            open_ = [(k, s, g) for k, s, g in self.pairs(nodes) if not self.legs[k].known(s, g)]
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
        """Whether some chain has a bound below the least one found: if unsolved legs weigh more
        than their bounds.
        """
        costs = [np.where(leg.is_solved, leg.cost, leg.least_costs) for leg in self.legs]
        return LeastChain(costs, self.closed).find()[0] < self._chain.find()[0] - SAME

    @abstractmethod
    def chain_tried(self, nodes: list[int]) -> None:
        """Takes note that every leg of a chain has been tried."""

    def _least_solved(self) -> list[int]:
        """The least chain of pairs that are all solved; no nodes if there is none."""
        costs = [np.where(leg.is_solved, leg.cost, np.inf) for leg in self.legs]
        return LeastChain(costs, self.closed).find()[1]

    def least_through(self, pairs: Iterable[tuple[int, int, int]]) -> list[int]:
        """The least chain of these pairs (leg, start node, goal node); no nodes if there is
        none."""
        costs = [np.full(leg.cost.shape, np.inf) for leg in self.legs]
        for k, s, g in pairs:
            costs[k][s, g] = self.legs[k].cost[s, g]
        return LeastChain(costs, self.closed).find()[1]

    def _no_chain(self) -> JoulepathError:
        """The error for no chain; it names the first stop to which none leads."""
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
