"""Chains of configurations, one of each layer: the least by the sum of the costs of its legs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array


class LeastChain:
    """The least chain through legs whose costs only rise from one question to the next, but for
    what `lower` says.

    `costs` are matrices (n_k, n_k+1) [J] of one leg each. A `closed` chain ends in the node in
    which it starts: each of these has a least chain of its own, which is looked for again only
    while what was found for it before is the least.
    """

    def __init__(self, costs: Sequence[Array], closed: bool) -> None:
        self.costs, self.closed = costs, closed
        self._known: Array | None = None

    def find(self) -> tuple[float, list[int]]:
        """The cost [J] of the least chain, and its nodes; inf and no nodes if there is none."""
        if not self.closed:
            return self._through(np.zeros(self.costs[0].shape[0]), None)
        if self._known is None:
            self._known = np.array([self._from(node)[0] for node in range(self.costs[0].shape[0])])
        while True:
            node = int(self._known.argmin())
            if not np.isfinite(self._known[node]):
                return np.inf, []
            value, nodes = self._from(node)
            risen = value > self._known[node]
            self._known[node] = value
            if not risen:
                return value, nodes

    def lower(self, by: float) -> None:
        """Say that one cost fell, by as much [J]: the only way in which costs may do that."""
        if self._known is not None:
            self._known -= by

    def _from(self, node: int) -> tuple[float, list[int]]:
        first = np.full(self.costs[0].shape[0], np.inf)
        first[node] = 0.0
        return self._through(first, node)

    def _through(self, first: Array, last: int | None) -> tuple[float, list[int]]:
        reached = [first]
        for cost in self.costs:
            # rows that nothing leads to are left out: with one first node, all but one
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
            # where each node came from is asked on one chain alone: several times less than for all
            # of them
            nodes.append(int((before + cost[:, nodes[-1]]).argmin()))
        return float(reached[-1][node]), nodes[::-1]
