"""Tours over groups, each once, by dynamic programming over their subsets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from models.robot import Array
from optimizer.deadline import checkpoint


class Tours:
    """Tours from a node of the start over all groups, back to this node if `closed`.

    `blocks` has the costs (n_a, n_b) [J] from the nodes in which group a is left to those in which group b is left;
    None is the start. `earlier` are the groups that come before each group.
    """

    def __init__(
        self, blocks: Mapping[tuple[int | None, int | None], Array], earlier: Sequence[set[int]], closed: bool
    ) -> None:
        self.count, self.closed = len(earlier), closed
        self.needed = [sum(1 << k for k in each) for each in earlier]
        sizes = [blocks[None, k].shape[1] for k in range(self.count)]
        ends = np.concatenate([[0], np.cumsum(sizes)])
        self.own = [slice(a, b) for a, b in pairwise(ends.tolist())]
        self.group = np.repeat(np.arange(self.count), sizes)
        self.first = np.hstack([blocks[None, k] for k in range(self.count)])
        self.between = np.full((ends[-1], ends[-1]), np.inf)
        for a in range(self.count):
            for b in range(self.count):
                if a != b:
                    self.between[self.own[a], self.own[b]] = blocks[a, b]
        starts = len(self.first)
        back = [blocks[k, None] if closed else np.zeros((sizes[k], starts)) for k in range(self.count)]
        self.back = np.vstack(back)

    def least(self) -> tuple[float, list[int], list[int]]:
        """Cost [J] of the least tour, its groups in their order, and the nodes in which the start and these are left;
        for a closed one the start's node again. Inf and nothing if there is none."""
        best, groups, ends = np.inf, list[int](), list[int]()
        for start in range(len(self.first)):
            reached = self._reached(start)
            total = reached[-1] + self.back[:, start]
            last = int(total.argmin())
            if total[last] < best:
                best = float(total[last])
                nodes = self._traced(reached, last)
                groups = [int(self.group[node]) for node in nodes]
                local = [node - self.own[k].start for node, k in zip(nodes, groups, strict=True)]
                ends = [start, *local, *([start] if self.closed else [])]
        return best, groups, ends

    def _reached(self, start: int) -> Array:
        """Least costs (2^groups, nodes) [J] of the ways from a node of the start over each subset to each node."""
        reached = np.full((1 << self.count, len(self.group)), np.inf)
        for k in range(self.count):
            if not self.needed[k]:
                reached[1 << k, self.own[k]] = self.first[start, self.own[k]]
        for subset in range(1, (1 << self.count) - 1):
            checkpoint()
            nodes = np.flatnonzero(np.isfinite(reached[subset]))
            if not len(nodes):
                continue
            onward = (reached[subset, nodes, None] + self.between[nodes]).min(axis=0)
            for k in range(self.count):
                if not subset >> k & 1 and subset & self.needed[k] == self.needed[k]:
                    reached[subset | 1 << k, self.own[k]] = onward[self.own[k]]
        return reached

    def _traced(self, reached: Array, last: int) -> list[int]:
        """The nodes of the least way over all groups that ends in node `last`."""
        nodes, subset = [last], (1 << self.count) - 1
        while True:
            subset ^= 1 << int(self.group[nodes[-1]])
            if not subset:
                return nodes[::-1]
            nodes.append(int((reached[subset] + self.between[:, nodes[-1]]).argmin()))
