"""Least chains of configurations, one configuration of every layer, by the sum of the leg costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array


@dataclass(frozen=True)
class LeastChainSettings:
    """Settings of least chains."""

    rounding: float = 1e-12
    """Relative rounding error of a sum of costs, far above that of thousands of legs."""


CHAINS = LeastChainSettings()


class LeastChain:
    """Least chain through legs with non-decreasing costs between calls of `find`.

    A decrease of a cost must be announced by `lower`. A closed chain ends in its first node, and
    every first node has a least chain of its own. A lower bound of each is known, at first that of
    the open chains from and to the node, and a chain is computed only while its bound is the least.

    Args:
        costs: cost matrix of every leg, shape (n_k, n_k+1) [J].
        closed: whether the last node of the chain equals the first.
    """

    def __init__(self, costs: Sequence[Array], closed: bool) -> None:
        self.costs, self.closed = costs, closed
        self._known: Array | None = None

    def find(self) -> tuple[float, list[int]]:
        """Cost [J] and nodes of the least chain; inf and no nodes if there is none."""
        if not self.closed:
            return self._through(np.zeros(self.costs[0].shape[0]), None)
        if self._known is None:
            self._known = self._open_bounds()
        while True:
            if not np.isfinite(self._known.min(initial=np.inf)):
                return np.inf, []
            node = int(self._known.argmin())
            value, nodes = self._from(node)
            risen = value > self._known[node]
            self._known[node] = value
            if not risen:
                return value, nodes

    def lower(self, by: float) -> None:
        """Announce the fall of one cost `by` an amount [J]; costs may fall in no other way.

        A decrease from infinity may connect nodes unreachable before.
        """
        if self._known is not None:
            self._known = self._known - by if np.isfinite(by) else None

    def _open_bounds(self) -> Array:
        """Lower bounds (n,) [J] of the closed chains through the first nodes.

        A closed chain costs no less than the least open ones from its node and to its node.
        """
        onwards, back = np.zeros(self.costs[-1].shape[1]), np.zeros(self.costs[0].shape[0])
        for cost in reversed(self.costs):
            onwards = (cost + onwards).min(axis=1, initial=np.inf)
        for cost in self.costs:
            back = (back[:, None] + cost).min(axis=0, initial=np.inf)
        bounds = np.maximum(onwards, back)
        # sums in another order round otherwise
        return bounds * (1 - CHAINS.rounding * np.sign(bounds))

    def _from(self, node: int) -> tuple[float, list[int]]:
        first = np.full(self.costs[0].shape[0], np.inf)
        first[node] = 0.0
        return self._through(first, node)

    def _through(self, first: Array, last: int | None) -> tuple[float, list[int]]:
        reached = [first]
        for cost in self.costs:
            # leave out unreachable rows: with one first node, these are all but one
            rows = np.flatnonzero(np.isfinite(reached[-1]))
            if not len(rows):
                return np.inf, []
            all_rows = len(rows) == len(cost)
            total = (
                reached[-1][:, None] + cost if all_rows else reached[-1][rows, None] + cost[rows]
            )
            reached.append(total.min(axis=0))
        node = int(reached[-1].argmin()) if last is None else last
        if not np.isfinite(reached[-1][node]):
            return np.inf, []
        nodes = [node]
        for before, cost in zip(reached[-2::-1], self.costs[::-1], strict=True):
            # backtracking one chain takes a fraction of storing all predecessors
            nodes.append(int((before + cost[:, nodes[-1]]).argmin()))
        return float(reached[-1][node]), nodes[::-1]
